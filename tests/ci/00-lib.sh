#!/usr/bin/env bash
# The guarantees of lib.bash for every check: a failure is reported with place and cause, and it waits for another apt.
source "$(dirname "$0")/lib.bash"

# planted TEXT...: the check on standard input fails, and its output has each of the texts.
planted() {
    local text
    { echo "source $PWD/tests/ci/lib.bash" && cat; } >"$work/planted.sh"
    if bash "$work/planted.sh" >"$work/planted.out" 2>"$work/planted.err"; then
        fail "passed, but should have failed: $(<"$work/planted.sh")"
    fi
    for text; do
        grep -qF -- "$text" "$work/planted.err" || fail "no \"$text\" in the output of a failed check"
    done
    [ "$(grep -c '^FAIL' "$work/planted.err")" = 1 ] || fail "a failure must be reported once"
    rm "$work/planted.err"
}

planted 'FAIL: ls /missing' "at $work/planted.sh:2" "at $work/planted.sh:4" "ls: cannot access '/missing'" <<'END'
deep() { ls /missing 2>"$work/deep.err"; }

found=$(deep | cat)
END
planted 'FAIL: grep -q needle' 'status 1' 'the end of search.err' 'hay' <<'END'
echo hay >"$work/search.err"
grep -q needle "$work/search.err"
END
planted 'out of time' <<<'timeout 0.1 sleep 5'
planted 'no such command' <<<'there-is-no-such-command'
planted 'FAIL: too little' <<<'few=$(fail "too little")'
planted 'should have been refused: true' <<<'refused text true'
planted 'no "that reason"' 'this reason' <<<'refused "that reason" bash -c "echo this reason >&2; false"'
# The shell has a keyword of that name; what is missing is the program.
planted 'apt-get install some-package' <<<'id() { echo 1000; }; need select some-package'
echo "ok: a failed check reports the command, its place and its output"

mkdir "$work/stub"
printf '#!/bin/sh\necho some complaint >&2\nexit 1\n' >"$work/stub/cargo"
chmod +x "$work/stub/cargo"
refused 'some complaint' env "PATH=$work/stub:$PATH" tests/run format
grep -q 'FAILED in format' "$work/refused.out"
refused 'is not a step' tests/run nonsense
echo "ok: the test command names the failed step"

if [ "$(id -u)" != 0 ] || ! type -P apt-get perl >/dev/null; then
    echo "- not tested without root on Debian: waiting for another apt"
    exit
fi
no_sources=(-o Dir::Etc::SourceList=/dev/null -o Dir::Etc::SourceParts=/dev/null -o APT::Get::List-Cleanup=0)
# waits_for LOCK ARGUMENT...: apt_get ARGUMENT... succeeds although another process has the lock for some seconds.
waits_for() {
    local lock=$1 before=$SECONDS
    shift
    rm -f "$work/held"
    # The kind of lock that apt takes, which flock(1) is not.
    perl -MFcntl -e 'open my $file, "+>>", $ARGV[0] or die; my $lock = pack "s s x4 l! l! i", F_WRLCK, 0, 0, 0, 0;
        fcntl $file, F_SETLKW, $lock or die; open my $held, ">", $ARGV[1] or die; sleep 4' "$lock" "$work/held" &
    eventually "the lock" test -e "$work/held"
    apt_get "$@" >"$work/waited.err"
    grep -q "waiting for another apt: Could not get lock $lock" "$work/waited.err" || fail "no mention of $lock"
    [ $((SECONDS - before)) -ge 3 ] || fail "did not wait for $lock"
    wait
}
waits_for /var/lib/apt/lists/lock "${no_sources[@]}" update
waits_for /var/lib/dpkg/lock-frontend check
waits_for /var/cache/apt/archives/lock autoclean
echo "ok: waits for another apt, for each of its three locks"
