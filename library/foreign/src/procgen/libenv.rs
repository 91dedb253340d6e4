//! The C interface of Procgen's library (`libenv.h`, version 1).
//!
//! What is called is a library whose bytes are known ([`Known`]), so that what is promised here of it was read in its
//! source: Procgen 0.10.7, `procgen/src/vecgame.cpp` and `game.cpp`. It ends the process where it is asked for what it
//! does not have; so nothing else can be asked here: a game is one of its list, and an action one of fifteen.

use std::ffi::{c_char, c_int, c_void};
use std::ptr::NonNull;

use super::found::Known;
use super::{ACTIONS, Game, LEVELS, SIDE};

/// How many bytes a picture has: rows of pixels of three bytes.
pub(super) const PICTURE: usize = SIDE * SIDE * 3;

/// How many bytes a name has, with the zero at its end.
const NAME: usize = 128;
/// What `dtype` is of bytes, and of whole numbers of 32 bits.
const BYTES: c_int = 1;
const WHOLE: c_int = 2;
/// What `libenv_version` is.
const VERSION: c_int = 1;

/// What a game is told in whole numbers, but for the first two, which are its own: of the seed nothing is drawn but which
/// of its levels comes next, and there is one; and it has no threads.
const NUMBERS: [(&str, i32); 7] = [
    ("start_level", 0),
    ("distribution_mode", 0),
    ("num_levels", 1),
    ("num_actions", 15),
    ("rand_seed", 0),
    ("num_threads", 0),
    ("debug_mode", 0),
];
/// What it is told besides: all as Procgen has it by default.
const FLAGS: [(&str, u8); 8] = [
    ("use_sequential_levels", 0),
    ("render_human", 0),
    ("center_agent", 1),
    ("use_generated_assets", 0),
    ("use_monochrome_assets", 0),
    ("restrict_themes", 0),
    ("use_backgrounds", 1),
    ("paint_vel_info", 0),
];

/// `struct libenv_option`.
#[repr(C)]
struct Choice {
    name: [c_char; NAME],
    dtype: c_int,
    count: c_int,
    data: *mut c_void,
}

/// `struct libenv_options`.
#[repr(C)]
struct Choices {
    items: *mut Choice,
    count: c_int,
}

/// `struct libenv_buffers`, of one game.
#[repr(C)]
struct Places {
    seen: *mut *mut c_void,
    reward: *mut f32,
    first: *mut u8,
    told: *mut *mut c_void,
    done: *mut *mut c_void,
}

/// The functions of the library, which stays loaded until the process ends.
pub(super) struct Library {
    make: unsafe extern "C" fn(c_int, Choices) -> *mut c_void,
    set_buffers: unsafe extern "C" fn(*mut c_void, *mut Places),
    observe: unsafe extern "C" fn(*mut c_void),
    act: unsafe extern "C" fn(*mut c_void),
    close: unsafe extern "C" fn(*mut c_void),
}

impl Library {
    /// Loads it.
    pub(super) fn load(known: &Known) -> Result<Self, String> {
        let failed = |error: libloading::Error| {
            format!("{} cannot be loaded: {error}", known.library().display())
        };
        // SAFETY: the bytes of the library are known. What runs when it is loaded are constructors of its own globals and
        // those of Qt, which is linked into it, and they have no preconditions.
        let loaded = unsafe { libloading::Library::new(known.library()) }.map_err(failed)?;
        // SAFETY: the types of the functions are those of `libenv.h`. The addresses remain valid, since the library is
        // never unloaded.
        let found = unsafe {
            let version = loaded.get::<unsafe extern "C" fn() -> c_int>(b"libenv_version\0");
            let version = version.map_err(failed)?;
            if version() != VERSION {
                return Err(format!("{} has another interface", known.library().display()));
            }
            Self {
                make: *loaded.get(b"libenv_make\0").map_err(failed)?,
                set_buffers: *loaded.get(b"libenv_set_buffers\0").map_err(failed)?,
                observe: *loaded.get(b"libenv_observe\0").map_err(failed)?,
                act: *loaded.get(b"libenv_act\0").map_err(failed)?,
                close: *loaded.get(b"libenv_close\0").map_err(failed)?,
            }
        };
        std::mem::forget(loaded);
        Ok(found)
    }

    /// Lets it read its pictures, which the first game of a process does: those that were just looked at.
    pub(super) fn read_pictures(&'static self, known: &Known) -> Ready {
        let game = Game { place: 0, is_hard: false, levels: [0, 1], pays: None };
        Running::with(self, &game, 0, format!("{}/", known.assets().display()));
        Ready(self)
    }
}

/// A library that has its pictures, without which it would end the process.
#[derive(Clone, Copy)]
pub(super) struct Ready(&'static Library);

/// A level that is played. The library has the addresses of what is in `Held`, which nobody else changes meanwhile.
pub(super) struct Running {
    handle: NonNull<c_void>,
    held: NonNull<Held>,
    observe: unsafe extern "C" fn(*mut c_void),
    act: unsafe extern "C" fn(*mut c_void),
    close: unsafe extern "C" fn(*mut c_void),
}

/// What the library reads and writes, in one place as long as it plays.
struct Held {
    // The values that `choices` points to.
    _texts: [Vec<u8>; 2],
    _numbers: Vec<i32>,
    _flags: Vec<u8>,
    choices: Vec<Choice>,

    action: i32,
    picture: [u8; PICTURE],
    reward: f32,
    first: u8,
    level_before: i32,
    is_complete: u8,
    level: i32,

    seen: [*mut c_void; 1],
    told: [*mut c_void; 3],
    done: [*mut c_void; 1],
    places: Places,
}

// SAFETY: a game has no thread of its own (`num_threads` is 0) and keeps nothing with the thread that calls it. `libenv.h`
// promises that several may be played from several threads at once; what they share are pictures, which nobody changes
// after the first game was made, under `std::call_once`. Here one is played through `&mut` alone.
unsafe impl Send for Running {}

impl Running {
    /// Begins a level.
    pub(super) fn begin(Ready(library): Ready, game: &Game, level: u32) -> Self {
        Self::with(library, game, level, String::new())
    }

    /// Begins a level, in the first game of a process with pictures that lie in `assets`.
    fn with(library: &Library, game: &Game, level: u32, assets: String) -> Self {
        assert!(u64::from(level) < LEVELS, "a level of Procgen");
        let level = i32::try_from(level).expect("it is below 2³¹");
        let mut new = Box::new(Held::new(game, level, assets));
        let count = c_int::try_from(new.choices.len()).expect("a few");
        let choices = Choices { items: new.choices.as_mut_ptr(), count };
        let held = NonNull::from(Box::leak(new));
        let at = held.as_ptr();
        // SAFETY: `at` was just allocated and is given back by `drop` alone, after the library has let go of it. No
        // reference to any of it is alive while the library is called. `set_places` writes addresses within it.
        // The options are all that the library knows, each of its type, and their values are in range: a game of the list,
        // a mode that all games have, a level below 2³¹ - 1. The pictures are all there, so that it finds each.
        // `libenv_make` returns what `new` does, which is not null. Of `libenv_set_buffers`, spaces are one picture, one
        // action and three numbers, in this order and of these sizes.
        let handle = unsafe {
            Held::set_places(at);
            let handle = NonNull::new((library.make)(1, choices)).expect("there is a game");
            (library.set_buffers)(handle.as_ptr(), &raw mut (*at).places);
            (library.observe)(handle.as_ptr());
            handle
        };
        let Library { observe, act, close, .. } = *library;
        Self { handle, held, observe, act, close }
    }

    /// Takes an action.
    ///
    /// # Panics
    /// If there is none of that number.
    pub(super) fn act(&mut self, action: usize) {
        assert!(action < ACTIONS.len(), "an action of Procgen");
        let (at, handle) = (self.held.as_ptr(), self.handle.as_ptr());
        // SAFETY: what is held is alive and nobody else's, since `self` is borrowed as a whole. The handle is of a game
        // that has its buffers and is not closed.
        unsafe {
            (*at).action = i32::try_from(action).expect("it is one of fifteen");
            (self.act)(handle);
            (self.observe)(handle);
        }
    }

    /// What is seen: rows of pixels of three bytes.
    pub(super) fn picture(&self) -> &[u8; PICTURE] {
        // SAFETY: what is held is alive as long as `self`, and the library writes it in `act` alone, for which `self`
        // would be borrowed mutably.
        unsafe { &(*self.held.as_ptr()).picture }
    }

    /// What the last action paid.
    pub(super) fn reward(&self) -> f32 {
        // SAFETY: as for the picture.
        unsafe { (*self.held.as_ptr()).reward }
    }

    /// Whether that was the last one of the episode, of which the picture is then the first of another.
    pub(super) fn is_over(&self) -> bool {
        // SAFETY: as for the picture. It is a byte of any value.
        unsafe { (*self.held.as_ptr()).first != 0 }
    }

    /// Whether the goal of the level was met by then.
    pub(super) fn is_complete(&self) -> bool {
        // SAFETY: as for the picture. It is a byte of any value.
        unsafe { (*self.held.as_ptr()).is_complete != 0 }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // SAFETY: the handle is open, and closed here alone. From then on the library has no address of what is held,
        // which `begin` took from a box.
        unsafe {
            (self.close)(self.handle.as_ptr());
            drop(Box::from_raw(self.held.as_ptr()));
        }
    }
}

impl Held {
    fn new(game: &Game, level: i32, assets: String) -> Self {
        let none: *mut c_void = std::ptr::null_mut();
        let mut texts = [("env_name", game.name().to_owned()), ("resource_root", assets)]
            .map(|(name, text)| (name, text.into_bytes()));
        let mut numbers: Vec<i32> = NUMBERS.iter().map(|(_, value)| *value).collect();
        numbers[..2].copy_from_slice(&[level, i32::from(game.is_hard)]);
        let mut flags: Vec<u8> = FLAGS.iter().map(|(_, value)| *value).collect();
        let (number, flag) = (numbers.as_mut_ptr(), flags.as_mut_ptr());
        let mut choices: Vec<Choice> = Vec::new();
        for (name, text) in &mut texts {
            choices.push(choice(name, BYTES, text.len(), text.as_mut_ptr().cast()));
        }
        for (i, (name, _)) in NUMBERS.iter().enumerate() {
            choices.push(choice(name, WHOLE, 1, number.wrapping_add(i).cast()));
        }
        for (i, (name, _)) in FLAGS.iter().enumerate() {
            choices.push(choice(name, BYTES, 1, flag.wrapping_add(i).cast()));
        }
        let (seen, reward, first) = (none.cast(), none.cast(), none.cast());
        Self {
            _texts: texts.map(|(_, text)| text),
            _numbers: numbers,
            _flags: flags,
            choices,
            action: 0,
            picture: [0; PICTURE],
            reward: 0.0,
            first: 0,
            level_before: 0,
            is_complete: 0,
            level: 0,
            seen: [none],
            told: [none; 3],
            done: [none],
            places: Places { seen, reward, first, told: seen, done: seen },
        }
    }

    /// Writes the addresses of what is held into what is held.
    ///
    /// # Safety
    /// `at` is valid for reads and writes, and nothing of it is borrowed.
    unsafe fn set_places(at: *mut Self) {
        // SAFETY: nothing but addresses of fields is made, and written to fields.
        unsafe {
            (*at).seen = [(&raw mut (*at).picture).cast()];
            (*at).told = [
                (&raw mut (*at).level_before).cast(),
                (&raw mut (*at).is_complete).cast(),
                (&raw mut (*at).level).cast(),
            ];
            (*at).done = [(&raw mut (*at).action).cast()];
            (*at).places = Places {
                seen: (&raw mut (*at).seen).cast(),
                reward: &raw mut (*at).reward,
                first: &raw mut (*at).first,
                told: (&raw mut (*at).told).cast(),
                done: (&raw mut (*at).done).cast(),
            };
        }
    }
}

/// One thing that the library is told.
fn choice(name: &str, dtype: c_int, count: usize, data: *mut c_void) -> Choice {
    let mut bytes = [0; NAME];
    for (byte, letter) in bytes[..NAME - 1].iter_mut().zip(name.bytes()) {
        *byte = c_char::from_ne_bytes([letter]);
    }
    Choice { name: bytes, dtype, count: c_int::try_from(count).expect("short"), data }
}
