//! One self-contained HTML page of studies: what was asked, the answer, plots, and the robot moving.
pub mod scene;
