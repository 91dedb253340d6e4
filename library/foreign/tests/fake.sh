#!/bin/sh
# Stands for Python: called as `fake.sh -c SCRIPT NAME KWARGS`, it speaks to two lanes as worlds.py does, of worlds
# that count. A world is at its seed, then at one more and the action with each step; action 1 ends an episode, and 2
# cuts it off. NAME says how it fails.
name=$3
echo $$ > "$0.pid"
frame=0
end=0

byte() { printf "\\$(($1 / 64))$(($1 / 8 % 8))$(($1 % 8))"; }

fail() {
    case $name in
        dies) echo last >&2; echo words >&2; exit 3 ;;
        killed) kill -9 $$ ;;
        hangs) echo waiting >&2; sleep 1000 ;;
        garbage) while :; do echo garbage; done ;;
        short) printf abc; exit 0 ;;
        shuts) exec >&-; sleep 1000 ;;
        chatty) i=0; while [ $i -lt 3000 ]; do echo "a line that nobody is to wait for $i" >&2; i=$((i + 1)); done ;;
    esac
}

case $name in
    refused) echo '{"refused": "there is no such world"}'; exit 0 ;;
    mute) sleep 1000 ;;
    endless) cat /dev/zero ;;
    crash) echo 'a Traceback' >&2; exit 1 ;;
esac
changed=0
if [ "$name" = changed ] && [ -e "$0.asked" ]; then changed=1; fi
: > "$0.asked"
echo "{\"sees\": [{\"name\": \"at\", \"shape\": [1], \"kind\": \"u8\", \"n\": 0}], \"actions\": {\"discrete\": 3}, \"limit\": 20, \"changed\": $changed}"
[ -n "$(dd bs=1 count=4 2>/dev/null | od -An -v -tu1)" ] || exit 0

at0=0 at1=0
while :; do
    # shellcheck disable=SC2046
    set -- $(dd bs=1 count=2 2>/dev/null | od -An -v -tu1)
    [ $# = 2 ] || exit 0
    first=$1 second=$2 n=8
    case "$1$2" in *0*) n=4 ;; esac
    # shellcheck disable=SC2046
    set -- $(dd bs=1 count=$n 2>/dev/null | od -An -v -tu1)
    frame=$((frame + 1)) lane=0 seen='' paid='' ends=''
    [ $frame = 3 ] && fail
    for what in "$first" "$second"; do
        if [ "$what" != 0 ]; then
            eval "at=\$at$lane"
            if [ "$what" = 2 ]; then at=$1 end=0; else at=$(((at + $1 + 1) % 256)) end=$1; fi
            [ "$name" = forgets ] && [ "$what$frame" = 13 ] && end=1
            eval "at$lane=$at"
            reward='0 0 0 0 0 0 240 63'
            [ "$name" = nan ] && reward='0 0 0 0 0 0 248 127'
            seen="$seen $at" paid="$paid $reward" ends="$ends $end"
            [ $n = 8 ] && [ $lane = 0 ] && shift 4
        fi
        lane=$((lane + 1))
    done
    for one in $((frame % 256)) $((frame / 256)) 0 0 $seen $paid $ends; do byte "$one"; done
done
