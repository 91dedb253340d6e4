use super::*;
use crate::npz::tests::random_numbers;

const STYLE: Style = Style { separator: b',', header: true, cells: Cells::Finite };

fn numbers(text: &[u8], style: Style) -> Result<Vec<(String, Vec<f64>)>, String> {
    let mut choose = |names: &[String]| Ok(vec![Want::Numbers; names.len()]);
    let columns = read(text, style, &mut choose)?.columns.into_iter();
    let columns = columns.map(|column| match column.values {
        Values::Numbers(numbers) => (column.name, numbers),
        Values::Texts(..) => unreachable!("numbers were asked for"),
    });
    Ok(columns.collect())
}

#[test]
fn what_is_written_is_read_to_the_bit() {
    let numbers_of = random_numbers(20_000);
    let style = Style { cells: Cells::Any, ..STYLE };
    let read = numbers(&write(&[("x", &numbers_of), ("y,z", &numbers_of)]), style).unwrap();
    assert_eq!([&*read[0].0, &*read[1].0], ["x", "y,z"]);
    let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan();
    assert!(read.iter().all(|(_, read)| numbers_of.iter().zip(read).all(same)));
}

#[test]
fn other_writers_are_understood() {
    let expected = || Ok(vec![("a b".to_owned(), vec![1.0, 2.5])]);
    for text in [
        &b"\xef\xbb\xbf\"a b\"\r\n1\r\n 2.5 \r\n"[..],
        b" a b \n \"1\" \n\"2.5\"",
        b"a b\r1\r2.5\r\r",
        b"a b\n1\n2.5\n\n\n\r\n",
        b"a b\n+1\n25e-1",
    ] {
        assert_eq!(numbers(text, STYLE), expected(), "{:?}", String::from_utf8_lossy(text));
    }
    let read = numbers(b"\"a \"\"b\"\", c\",y\n1,2\n\n3,4\n", STYLE).unwrap();
    assert_eq!(read[0], ("a \"b\", c".to_owned(), vec![1.0, 3.0]));
    let style = Style { separator: b';', header: false, ..STYLE };
    let read = numbers(b"1;2\n3;4", style).unwrap();
    assert_eq!(read, [("0".to_owned(), vec![1.0, 3.0]), ("1".to_owned(), vec![2.0, 4.0])]);
    let tabs = Style { separator: b'\t', ..STYLE };
    assert_eq!(numbers(b"a\tb\n\"1\"\t2", tabs).unwrap()[1], ("b".to_owned(), vec![2.0]));
}

#[test]
fn texts_are_told_apart_and_what_is_not_wanted_is_not_read() {
    let mut choose = |_: &[String]| Ok(vec![Want::Texts, Want::Nothing]);
    let text = "a,b\n\"x\ny\",junk\nü,\"1\n2\"\n\"x\ny\",3\n";
    let read = read(text.as_bytes(), STYLE, &mut choose).unwrap().columns;
    let texts = ["x\ny", "ü"].map(str::to_owned).to_vec();
    assert_eq!((read.len(), &read[0].values), (1, &Values::Texts(texts, vec![0, 1, 0])));
}

#[test]
fn gaps_are_what_is_not_a_number() {
    let style = Style { cells: Cells::Gaps, ..STYLE };
    for gap in ["", "NA", "n/a", "NULL", "-", "?", "nan", " "] {
        let read = numbers(format!("x,y\n{gap},1\n").as_bytes(), style).unwrap();
        assert!(read[0].1[0].is_nan(), "{gap}");
    }
    assert!(numbers(b"x\ninf\n", style).is_err() && numbers(b"x\ntwo\n", style).is_err());
}

#[test]
fn what_is_wrong_is_told() {
    let check = |text: &str, expected: &str| {
        let why = numbers(text.as_bytes(), STYLE).unwrap_err();
        assert!(why.contains(expected), "{why}");
    };
    check("", "no names of columns");
    check("\nx\n1", "no names of columns");
    check(" \n1", "no names of columns");
    check("x,y\n1\n", "line 2 has 1 values for 2 columns");
    check("x,y\n1,2,3\n", "line 2 has 3 values for 2 columns");
    check("x,y\n1,2\n1,two\n", "line 3, column `y`: `two` is no number");
    check("x,y\n1,NA\n", "line 2, column `y`: `NA` is no number: leave such rows out");
    check("x,y\n,1\n", "line 2, column `x`: there is none: leave such rows out");
    check("x,y\n1,nan\n", "line 2, column `y`: `nan` is not a number: leave");
    check("x,y\n1,-inf\n", "line 2, column `y`: `-inf` is not finite");
    check("x,y\n\"1,5\",2\n", "line 2, column `x`: `1,5` is no number: write `1.5`, with a point");
    check("x,y\n\"1,000\",2\n", "`1,000` is no number: write `1000` or `1.000`, whichever it is");
    check("x\r1\ra", "line 3, column `x`: `a` is no number");
    check("x,y\n\"1\",2\n\n\n3,\"a\n\"\n", "line 5, column `y`: `a` is no number");
    check("x,y\n\"1\n\",2\n3,a\n", "line 4, column `y`: `a` is no number");
    check("x,y\nTrue,2\n", "column `x`: `True` is no number: write 1 for true");
    check("x;y\n1;2\n", "its columns are separated by `;`, and not by `,`: write `,`");
    check("x\ty\n1\t2\n", "separated by tabs");
    check("x,y\n\"1,2\n", "line 2 has a quote that does not end");
    check("x,y\n\"1\"2,2\n", "line 2 has `2,2` behind a quote that ended");
    check("x,y\n1,2\n \n3,4\n", "line 3 has 1 values for 2 columns: it is empty");
    check("x\n1\n\n2\n", "line 3 has no value: it is empty");
    check("x\r\n1\r\n\r\n2\r\n", "line 3 has no value: it is empty");
    check(
        "x\n9007199254740992\n-9007199254740993\n",
        "line 3, column `x`: it holds -9007199254740993, which is too large",
    );
    check("x\n100000000000000000000000\n", "too large to be exact");
    check("x,x\n1,2\n", "two columns are called `x`");
    check("x\n1\0\n", "it has a byte 0");
    let huge = format!("x\n{}\n", "9".repeat(1 << 20));
    assert!(numbers(huge.as_bytes(), STYLE).unwrap_err().len() < 200);
    assert!(numbers(b"x\n\xff\n", STYLE).unwrap_err().contains("no number"));
    assert!(numbers(b"\xff\n1\n", STYLE).unwrap_err().contains("UTF-8"));
    assert!(numbers(b"", Style { header: false, ..STYLE }).unwrap_err().contains("empty"));
}

#[test]
fn plain_rows_are_what_the_other_reader_makes_of_them() {
    let wants = [Want::Numbers, Want::Nothing, Want::Numbers];
    let check = |text: &[u8], style: Style| {
        let mut choose =
            |names: &[String]| Ok(names.iter().zip(wants).map(|(_, want)| want).collect());
        let [fast, slow] =
            [true, false].map(|lane| match read_by(text, style, &mut choose, lane) {
                Ok(table) => format!("{:?}", table.columns),
                Err(why) => why,
            });
        assert_eq!(fast, slow, "{:?}", String::from_utf8_lossy(text));
    };
    let text = b"a,b,c\n1.5,-2,3e-2\r\n0.1,x y,7\n-4,,.5\n9007199254740991,5,1e400\n12,6,+7.\n";
    let bytes = [b'"', b',', b'\n', b'\r', b' ', 0xff, b'x', b'0', b'e', b'-', b'.', b';'];
    for cells in [Cells::Finite, Cells::Gaps, Cells::Any] {
        for header in [true, false] {
            let style = Style { header, cells, ..STYLE };
            for i in 0..text.len() {
                for byte in bytes {
                    let mut other = text.to_vec();
                    other[i] = byte;
                    check(&other, style);
                    other[i] = text[i];
                    other.insert(i, byte);
                    check(&other, style);
                }
                check(&text[..i], style);
                check(&text[i..], style);
            }
        }
    }
    for text in ["a\n1\n\n2\n", "a\r1\r2", "a\r\n1\r\n\r\n", "a\n1", "a\n", "a", "a\n1\n2\n\n"] {
        check(text.as_bytes(), STYLE);
    }
}

#[test]
fn whatever_the_bytes_nothing_breaks() {
    let text = b"a,\"b\"\r\n\"1\",2\n-3e5,\"4\"\n";
    for i in 0..text.len() {
        for byte in [b'"', b',', b'\n', b'\r', 0xff, b'x'] {
            let mut other = text.to_vec();
            other[i] = byte;
            drop(numbers(&other, STYLE));
        }
        drop(numbers(&text[..i], STYLE));
    }
}
