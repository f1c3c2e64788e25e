//! What supple reads from elsewhere, as functions of bytes: none of them may panic, hang, exhaust memory, or take as valid
//! what is not finite.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use supple::EvaluateOptions;
use supple::scene::Scene;
use supple_explore::Explorer;
use supple_file::{Files, ReadOptions};
use supple_robot::LoadOptions;
use supple_study::{Folder, JOURNAL, LoadedTask, RESULT};
use tempfile::TempDir;

/// What a target does with an input.
pub type Target = fn(&[u8]);

/// All targets by name.
pub const TARGETS: [(&str, Target); 8] = [
    ("task", task),
    ("robot", robot),
    ("mesh", mesh),
    ("table", table),
    ("expression", expression),
    ("result", result),
    ("journal", journal),
    ("request", request),
];

/// The folder of this crate.
pub fn home() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Steps, states and controls up to which tasks are planned too: larger ones are only read.
const FEW: usize = 12;

/// A task file. What can be read and is small is planned, within a fraction of a second.
pub fn task(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let name = home().join("../tasks/task.toml");
    let Ok(mut problem) = supple_file::parse(&text, &name.display().to_string()) else { return };
    let is_small = |task: &supple::Task| task.steps <= FEW && task.system.dimensions().joint() <= FEW;
    if !problem.tasks.iter().all(is_small) {
        return;
    }
    problem.planning.time_limit = Some(0.2);
    let options = EvaluateOptions { rollouts: 2, ..EvaluateOptions::default() };
    let Ok(at) = problem.evaluate(&problem.parameters.initial(), &options) else { return };
    if at.feasible {
        for task in &at.tasks {
            assert!(task.cost.expected.is_finite() && task.information.total_nats.is_finite(), "{task:?}");
        }
    }
}

/// A robot file, of whichever format it says it is.
pub fn robot(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let name = home().join("../models/robot.xml");
    let Ok(robot) = supple_robot::parse(&text, &name.display().to_string(), &LoadOptions::default()) else { return };
    let masses = robot.links.iter().filter_map(|link| link.inertia.as_ref()).map(|inertia| inertia.mass);
    assert!(masses.into_iter().all(|mass| mass.is_finite() && mass >= 0.0), "masses are finite and not negative");
}

/// A folder that stays as long as the program.
fn folder() -> &'static TempDir {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    FOLDER.get_or_init(|| tempfile::tempdir().expect("a folder for temporary files"))
}

fn write(name: &str, data: &[u8]) -> PathBuf {
    let path = folder().path().join(name);
    std::fs::create_dir_all(path.parent().expect("it has a folder")).expect("the folder is made");
    std::fs::write(&path, data).expect("the file is written");
    path
}

/// Endings of mesh files.
const MESHES: [&str; 3] = ["stl", "obj", "dae"];

/// A pendulum that is drawn by a mesh.
fn drawn(ending: &str) -> Scene {
    let robot = format!(
        r#"<robot name="one"><link name="base"/><link name="bob"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1"
        izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial><visual><geometry><mesh filename="mesh.{ending}"/></geometry></visual>
        </link><joint name="hinge" type="continuous"><parent link="base"/><child link="bob"/><axis xyz="0 1 0"/></joint>
        </robot>"#
    );
    let folder = format!("mesh-{ending}");
    write(&format!("{folder}/one.urdf"), robot.as_bytes());
    write(&format!("{folder}/mesh.{ending}"), b"");
    let task = r#"
        title = "drawn"
        [model]
        kind = "robot"
        file = "one.urdf"
        [[model.sensors]]
        kind = "joint_position"
        variance = 1e-4
        [[tasks]]
        name = "hold"
        steps = 3
        time_step = 0.01
        noise = { initial = { "q.*" = 1e-4 }, process = { "v.*" = 1e-6 } }
        [[tasks.costs]]
        kind = "control"
        weight = 1.0
    "#;
    let name = write(&format!("{folder}/task.toml"), task.as_bytes());
    let problem = supple_file::parse(task, &name.display().to_string()).unwrap_or_else(|error| panic!("{error}"));
    let options = EvaluateOptions { trajectories: true, ..EvaluateOptions::default() };
    let mut at = problem.evaluate(&problem.parameters.initial(), &options).unwrap_or_else(|error| panic!("{error}"));
    at.tasks.remove(0).trajectory.and_then(|trajectory| trajectory.scene).expect("robots are drawn")
}

/// A mesh file: the first byte says of which kind.
pub fn mesh(data: &[u8]) {
    static SCENES: OnceLock<Vec<Scene>> = OnceLock::new();
    let Some((&kind, data)) = data.split_first() else { return };
    let scenes = SCENES.get_or_init(|| MESHES.map(drawn).to_vec());
    let place = usize::from(kind) % MESHES.len();
    write(&format!("mesh-{0}/mesh.{0}", MESHES[place]), data);
    let drawn = supple_report::scene::data(&[("mesh", &scenes[place])]);
    for surface in drawn["meshes"].as_array().expect("surfaces are a list") {
        let text = surface["vertices"].as_str().expect("vertices are text");
        let bytes = STANDARD.decode(text).expect("vertices are in base64");
        let numbers = bytes.chunks_exact(4).filter_map(|four| four.try_into().ok()).map(f32::from_le_bytes);
        assert!(numbers.into_iter().all(f32::is_finite), "vertices are finite");
    }
}

/// A catalogue of sensors as a table.
pub fn table(data: &[u8]) {
    static TASK: OnceLock<(String, String)> = OnceLock::new();
    let (text, name) = TASK.get_or_init(|| {
        let path = home().join("../tasks/wiping_arm_sensors.toml");
        let text = std::fs::read_to_string(&path).expect("the shipped task is read");
        (text, path.display().to_string())
    });
    let csv = Path::new(name).with_file_name("wiping_arm_sensors.csv").display().to_string();
    let text_of = String::from_utf8_lossy(data).into_owned();
    let files = Files::given([(csv, text_of)]);
    let read = supple_file::parse_with(text, name, ReadOptions { files, ..ReadOptions::default() });
    if let Ok(problem) = read {
        let sensors = problem.catalogue.unwrap_or_default();
        assert!(sensors.iter().all(|sensor| sensor.price.is_finite() && sensor.price >= 0.0));
    }
}

/// An expression of parameters, as a cost's weight.
pub fn expression(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let quoted = serde_json::to_string(&text).expect("text is written as JSON");
    let task = format!(
        r#"
        title = "expression"
        [model]
        kind = "linear"
        A = [[1.0, 0.1], [0.0, 0.9]]
        B = [[0.0], [0.1]]
        C = [[1.0, 0.0]]
        [parameters.k]
        initial = 2.0
        bounds = [1.0, 3.0]
        [parameters.m]
        initial = 0.5
        bounds = [0.1, 1.0]
        [[tasks]]
        name = "hold"
        steps = 5
        time_step = 0.1
        initial_state = [1.0, 0.0]
        noise = {{ initial = [1e-4, 1e-4], process = [1e-6, 1e-6], measurement = [1e-4] }}
        [[tasks.costs]]
        kind = "control"
        weight = {quoted}
    "#
    );
    self::task(task.as_bytes());
}

/// The `result.json` of a folder.
pub fn result(data: &[u8]) {
    let path = write(&format!("result/{RESULT}"), data);
    let folder = path.parent().expect("it has a folder");
    if let Ok(read) = Folder::load(folder) {
        let _ = supple_report::page(&[read]);
    }
}

/// The journal of a study.
pub fn journal(data: &[u8]) {
    let path = write(&format!("journal/{JOURNAL}"), data);
    let _ = supple_study::kept_parts(path.parent().expect("it has a folder"));
    let _ = std::fs::remove_file(path);
}

/// Where the server of the explorer listens, and its token.
fn served() -> &'static (u16, String) {
    static SERVED: OnceLock<(u16, String)> = OnceLock::new();
    SERVED.get_or_init(|| {
        // What pages save is written to a folder that goes away.
        let text = std::fs::read(home().join("../tasks/two_mass_small.toml")).expect("the shipped task is read");
        let path = write("page/task.toml", &text);
        std::env::set_current_dir(folder().path()).expect("the folder is there");
        let task = LoadedTask::load(&path).unwrap_or_else(|error| panic!("{error}"));
        let explorer = Explorer::open(task, None, None).unwrap_or_else(|error| panic!("{error}"));
        let address = explorer.address();
        let (host, token) = address.rsplit_once("/?token=").expect("the address has a token");
        let port = host.rsplit(':').next().and_then(|port| port.parse().ok()).expect("the address has a port");
        let found = (port, token.to_owned());
        std::thread::spawn(move || explorer.serve());
        open_page(&found);
        found
    })
}

/// Opens the channel of a page, the first one, and hears what is pushed to it.
fn open_page((port, token): &(u16, String)) {
    let mut stream = TcpStream::connect(("127.0.0.1", *port)).expect("the server listens");
    let request = format!(
        "GET /channel?token={token} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nOrigin: http://127.0.0.1:{port}\r\n\
         Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
         Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    );
    stream.write_all(request.as_bytes()).expect("the server reads");
    let mut heard = [0; 4096];
    let mut said = Vec::new();
    while !String::from_utf8_lossy(&said).contains("hello") {
        let count = stream.read(&mut heard).expect("the server answers");
        assert!(count > 0, "{}", String::from_utf8_lossy(&said));
        said.extend_from_slice(&heard[..count]);
    }
    std::thread::spawn(move || while stream.read(&mut heard).is_ok_and(|count| count > 0) {});
}

/// What a page sends to the explorer: the first byte says whether all of it, or the body of a request that is let in.
pub fn request(data: &[u8]) {
    let Some((&kind, data)) = data.split_first() else { return };
    let (port, token) = served();
    let mut bytes = Vec::new();
    if kind % 2 == 0 {
        bytes.extend_from_slice(data);
    } else {
        let head = format!(
            "POST /ask?page=1&token={token} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\
             Origin: http://127.0.0.1:{port}\r\nContent-Length: {}\r\n\r\n",
            data.len()
        );
        bytes.extend_from_slice(head.as_bytes());
        bytes.extend_from_slice(data);
    }
    let Ok(mut stream) = TcpStream::connect(("127.0.0.1", *port)) else { panic!("the server is gone") };
    let patience = Some(Duration::from_secs(5));
    let (_, _) = (stream.set_read_timeout(patience), stream.set_write_timeout(patience));
    let _ = stream.write_all(&bytes);
    let _ = stream.shutdown(std::net::Shutdown::Write);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
}
