# Judges a run under noise.py, in the folder with its outputs.

judge_noise() { # judge_noise CONTROLLER: the process; sets $noise_says
    kill -TERM "$noise" && wait "$noise" || fail "the noise did not end"
    # What is still on its way to the controller.
    sleep 0.5
    kill -INT "$1" && wait "$1" || fail "the controller did not end cleanly"
    local counted sent frames samples
    counted=$(sed -n 's/.*frames not used: \(.*\); not sent: .*/\1/p' controller.err)
    sent=$(sed -n 2p noise.txt)
    [ "$counted" = "$sent" ] || fail "the controller has counted '$counted', sent were '$sent'"
    frames=$(tail -n 1 noise.txt)
    samples=$(grep -c ' 1C0##' noisy/trace.log)
    # A run takes a quarter of the bus by itself; six classical frames of 8 bytes in 1 ms take the rest.
    [ "$frames" -ge $((6 * samples)) ] || fail "only $frames bad frames in $samples samples"
    # A fresh controller that gets the frames of the run without the bad ones gives the same commands, byte for byte.
    "$plant_sim" trace replay noisy/trace.log >replay.txt 2>replay.err || fail "commands differ from those without bad frames"
    noise_says="$frames bad frames in $samples samples: each counted by its cause, the torques those of a controller without them"
}
