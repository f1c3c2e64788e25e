//! The same bits on every x86-64: the C library, which chooses its code by the processor, has no part in results.
#![cfg(all(target_os = "linux", target_arch = "x86_64", target_env = "gnu"))]

use std::process::Command;

use crate::common::repository;

/// What is printed with and without the instructions that the C library would use.
fn both(task: &str, more: &[&str]) -> [Vec<u8>; 2] {
    ["", "glibc.cpu.hwcaps=-FMA,-AVX2,-AVX2_Usable,-FMA_Usable,-FMA4"].map(|tunables| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_supple"));
        command.args(["evaluate", "--json", "--instructions", "baseline", "--threads", "2"]).args(more);
        command.arg(repository(&format!("tasks/{task}.toml")));
        command.env("GLIBC_TUNABLES", tunables);
        let output = command.output().unwrap();
        assert!(output.stdout.len() > 1000, "{}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    })
}

fn assert_same(task: &str, more: &[&str]) {
    let [with, without] = both(task, more);
    assert!(with == without, "{task}: other bits without the C library's instructions");
}

#[test]
fn the_wiping_arm_had_other_bits() {
    assert_same("wiping_arm", &["--rollouts", "4"]);
}

#[test]
fn the_door_had_other_bits() {
    assert_same("iiwa_door", &["--rollouts", "2"]);
}

#[test]
fn the_elbow_had_other_bits() {
    assert_same("elastic_elbow", &["--rollouts", "4"]);
}
