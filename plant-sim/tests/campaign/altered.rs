//! Results that were changed and are still some.

use std::fs;

use super::{Bench, CASES};

/// Lines that are whole, and say what is not so.
#[test]
fn altered_results_are_not_merged() {
    let bench = Bench::new();
    bench.run("0/2", "out", &[]);
    bench.run("1/2", "out", &[]);
    let merged = bench.call(&["merge", "out"], 0).stdout;
    let file = "out/results-0-of-2.jsonl";
    let whole = bench.read(file);
    let changed = "line 2 is case 0, and not as it was written";
    let first = "line 1 is not that of results of part 0/2";
    for (from, to, why) in [
        (
            "seed\":2}",
            "seed\":9}",
            "line 3 is case 2, and not as it was",
        ),
        ("duplicate@525ms", "duplicate@526ms", changed),
        ("survived\":true", "survived\":false", changed),
        ("missed\":[]", "missed\":[\"drop\"]", changed),
        ("hash\":\"", "hash\":\"0", changed),
        (
            "missed\":[]",
            "missed\":[\"all\"]",
            "line 2 is no result of a case",
        ),
        ("part\":0,\"of\":2", "part\":7,\"of\":2", first),
        ("part\":0,\"of\":2", "part\":0,\"of\":0", first),
    ] {
        let altered = whole.replacen(from, to, 1);
        assert!(altered != whole, "{from}");
        fs::write(bench.path(file), altered).unwrap();
        bench.refused(&["merge", "out"], why);
        let missing = bench.call(&["missing", "out"], 0);
        let said = String::from_utf8_lossy(&missing.stderr);
        assert!(said.contains(file) && said.contains(why), "{why}: {said}");
        bench.run("0/2", "out", &["--resume"]);
        assert_eq!(bench.call(&["merge", "out"], 0).stdout, merged, "{why}");
    }
    // A whole line, of another plan.
    let other = Bench::with(&CASES.replace("from = 525", "from = 524"));
    other.run("0/2", "out", &[]);
    let theirs = other.read(file);
    let lines = whole.lines().take(1).chain(theirs.lines().skip(1));
    let mixed: String = lines.map(|line| format!("{line}\n")).collect();
    fs::write(bench.path(file), mixed).unwrap();
    bench.refused(&["merge", "out"], "is not as the plan has it");
    fs::write(bench.path(file), &whole).unwrap();
    // Merged results are read by the report.
    let text = String::from_utf8(merged).unwrap();
    let altered = text.replacen("\"survived\":true", "\"survived\":false", 1);
    fs::write(bench.path("altered.jsonl"), altered).unwrap();
    bench.refused(
        &["report", "altered.jsonl"],
        "altered.jsonl: line 2 is case 0, and not as it was written: its hash is another; merge them again",
    );
    // A plan of another length is another plan, even where this part has as many cases of it.
    for (part, cases) in [(0, "\"cases\":23"), (1, "\"cases\":25")] {
        let file = bench.path(&format!("out/results-{part}-of-2.jsonl"));
        let whole = fs::read_to_string(&file).unwrap();
        fs::write(&file, whole.replacen("\"cases\":24", cases, 1)).unwrap();
        bench.refused(&["merge", "out"], "results of another plan than");
        fs::write(&file, whole).unwrap();
    }
}
