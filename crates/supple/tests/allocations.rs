//! The inner sweeps allocate nothing once their memory exists.
#![allow(clippy::unwrap_used, unsafe_code, clippy::undocumented_unsafe_blocks)]

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use common::shipped;
use supple::gradient::{FrozenGradient, Functional};
use supple::pipeline::TaskState;

struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(work: impl FnOnce()) -> usize {
    let before = COUNT.with(Cell::get);
    work();
    COUNT.with(Cell::get) - before
}

#[test]
fn sweeps_allocate_nothing_after_the_first_run() {
    let problem = shipped("two_mass.toml");
    let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
    let guess = task.guess(&phi, 1.0);
    let mut state = TaskState::new(task);
    let (mut frozen, mut total) = (FrozenGradient::default(), Vec::new());
    let mut all = |state: &mut TaskState| {
        state.evaluate(task, &phi, &problem.planning, Some(&guess)).unwrap();
        state.frozen_gradient(task, &phi, &mut frozen);
        state.total_gradient(task, &phi, Functional::INFORMATION, &mut total).unwrap();
        state.total_gradient(task, &phi, Functional::NOISE, &mut total).unwrap();
        state.nominal_gradient(task, &phi, &mut total).unwrap();
    };
    assert!(allocations(|| all(&mut state)) > 0, "the counter counts");
    let again = allocations(|| all(&mut state));
    // log|V| and V^-1 are found once per evaluation from a small copy of V, outside the sweeps.
    assert!(again <= 4, "{again} allocations");
    assert!(state.plan.iterations > 5, "it did plan");
    let plan = allocations(|| state.plan_only(task, &phi, &problem.planning, Some(&guess)).unwrap());
    assert_eq!(plan, 0, "planning allocates nothing at all");
}
