//! Counts of `trace stats`.

use super::*;

/// Periods of 900 and 1100 us in turn: mean 1000, standard deviation 100 us exactly; then a gap of three samples.
#[test]
fn statistics_are_those_of_the_definition() {
    let times: Vec<u64> = (0..101).map(|n| 1000 * n - 100 * (n % 2)).collect();
    let mut records: Vec<Record> = times
        .iter()
        .zip(0..)
        .map(|(&time, n)| record(time, feedback(n)))
        .collect();
    let line = bus(&records).ids.remove(0);
    let period = line.period.unwrap();
    assert_eq!(line.frames, 101);
    // 100 additions of a running mean and of squares: a few hundred rounding errors of 2^-53 at most.
    let close = |found: f64, expected: f64| (found - expected).abs() <= 1e-12 * expected.max(1.0);
    assert!(close(period.mean_ms, 1.0) && close(period.jitter_ms, 0.1));
    assert_eq!((period.min_ms, period.max_ms), (0.9, 1.1));
    assert_eq!((line.gaps, line.lost, line.duplicate), (0, 0, 0));

    records.push(record(104_000, feedback(104)));
    records.push(record(104_100, feedback(104)));
    records.push(record(104_200, feedback(103)));
    let mut damaged = *feedback(105).data().first_chunk::<48>().unwrap();
    damaged[0] ^= 0x80;
    let id = StandardId::new(table::FEEDBACK.id).unwrap();
    records.push(record(104_300, CanFrame::fd(id, &damaged, true).unwrap()));
    records.push(record(104_400, CanFrame::fd(id, &[], true).unwrap()));
    let line = bus(&records).ids.remove(0);
    assert_eq!(
        (
            line.gaps,
            line.lost,
            line.duplicate,
            line.stale,
            line.crc,
            line.refused
        ),
        (1, 3, 1, 1, 1, 1)
    );
}

/// Bits on the wire over time, as computed by the bus itself.
#[test]
fn load_is_the_time_of_the_frames() {
    let records = good();
    let busy: u64 = records
        .iter()
        .map(|record| {
            BitTiming::default()
                .duration(FrameBits::exact(&frame_of(record)))
                .nanos()
        })
        .sum();
    let statistics = bus(&records);
    assert_eq!(statistics.load, busy as f64 / 9_200_000.0);
    let by_id: f64 = statistics.ids.iter().map(|line| line.load).sum();
    assert!((by_id - statistics.load).abs() < 1e-12);
}
