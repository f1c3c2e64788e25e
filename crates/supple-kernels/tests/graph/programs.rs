//! Programs at one knot, at many, and on several threads.

use supple_kernels::graph::{Batch, Program, Target, record};
use supple_kernels::{Matrices, Scalar, Scratch};

use super::{Setting, hold_level, nodes, set};

/// Long batches are shared by the threads of the pool, in whatever pieces.
#[test]
fn threads_do_not_change_a_bit() {
    let _guard = hold_level();
    let program = record(|| {
        let inputs = nodes();
        let mut x = inputs[0];
        for _ in 0..200 {
            x = (x * inputs[1] + inputs[5]).sin() * inputs[6] + inputs[2];
        }
        Program::compile(&set(&[x, x * x]))
    });
    let setting = Setting::new(9_001, 5);
    let run = |threads: usize, first: usize, count: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut out = Matrices::vectors(setting.knots.count(), 2);
        pool.install(|| {
            let inputs = (&setting.sources()[..], &setting.parameters[..]);
            program.run(Batch { first, count }, inputs, (Some(&mut out), &mut []), &mut Scratch::new());
        });
        out
    };
    let alone = run(1, 3, 8_997);
    assert_eq!(alone.get(2, 0, 0), 0.0);
    assert_eq!(alone.get(9_000, 0, 0), 0.0);
    for threads in [2, 3, 7] {
        assert!(run(threads, 3, 8_997) == alone, "{threads} threads");
    }
}

/// A program of millions of instructions was divided among threads even at a single knot, without end.
#[test]
fn long_programs_at_few_knots_end() {
    let _guard = hold_level();
    let program = record(|| {
        let inputs = nodes();
        let mut x = inputs[0];
        for _ in 0..2_000_001 {
            x = x * inputs[1] + inputs[2];
        }
        Program::compile(&set(&[x]))
    });
    assert!(program.len() > 2_000_000);
    let setting = Setting::new(20, 5);
    let run = |threads: usize, count: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut out = Matrices::vectors(setting.knots.count(), 1);
        let inputs = (&setting.sources()[..], &setting.parameters[..]);
        let batch = Batch { first: 0, count };
        pool.install(|| program.run(batch, inputs, (Some(&mut out), &mut []), &mut Scratch::new()));
        out
    };
    for count in [1, 2, 16, 17, 19] {
        assert!(run(2, count) == run(1, count), "{count} knots");
    }
}

/// One knot at a time, a program does with its sinks what it does with those of batches.
#[test]
fn single_runs_add_to_what_is_there() {
    let _guard = hold_level();
    let setting = Setting::new(1, 3);
    let program = record(|| {
        let [x, y, ..] = nodes();
        let add = Target::Add { sink: 1, offset: 2 };
        Program::compile(&[(x + y, Target::Set { sink: 1, offset: 0 }), (x * y, add), (y, Target::Sum { index: 1 })])
    });
    let [x, y, ..] = setting.at(0);
    let (mut sums, mut sink) = ([10.0, 20.0], [30.0, 40.0, 50.0]);
    let knot = setting.knots.as_slice();
    program.run_single(&[knot, setting.others.vector(1)], &setting.parameters, &mut [&mut sums, &mut sink]);
    assert_eq!(sums, [10.0, 20.0 + y]);
    assert_eq!((sink[0], sink[1]), (x + y, 40.0));
    assert!((sink[2] - (50.0 + x * y)).abs() < 1e-14);
}

/// Nothing is read or written where there is nothing to do, wherever that is.
#[test]
fn batches_of_no_knots_do_nothing() {
    let _guard = hold_level();
    let setting = Setting::new(2, 3);
    let program = record(|| Program::compile(&set(&[nodes()[0] * nodes()[1]])));
    let mut out = Matrices::vectors(2, 1);
    for first in [0, 2, 7] {
        let given = (&setting.sources()[..], &setting.parameters[..]);
        program.run(Batch { first, count: 0 }, given, (Some(&mut out), &mut []), &mut Scratch::new());
    }
    assert_eq!(out, Matrices::vectors(2, 1));
    let nothing = record(|| Program::compile(&[]));
    nothing.run(Batch { first: 7, count: 3 }, (&[], &[]), (Some(&mut out), &mut []), &mut Scratch::new());
    assert_eq!(out, Matrices::vectors(2, 1));
}

/// The two sides of a program that sums may be shared with: neither threads nor their absence change what sums hold.
#[test]
fn sums_of_long_batches_are_in_the_order_of_the_knots() {
    let _guard = hold_level();
    let program = record(|| {
        let inputs = nodes();
        let x = (0..300).fold(inputs[0], |x, _| (x * inputs[1]).sin() + inputs[2]);
        Program::compile(&[(x, Target::Set { sink: 0, offset: 0 }), (x, Target::Sum { index: 0 })])
    });
    let setting = Setting::new(9_001, 6);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let (out, sums) = pool.install(|| setting.run(&program, 1, 1, 9_000));
    let in_order = (1..9_001).fold(0.0, |sum, t| sum + out.get(t, 0, 0));
    assert_eq!(sums[0].to_bits(), f64::to_bits(in_order));
    assert_eq!(out.get(0, 0, 0), 0.0);
}
