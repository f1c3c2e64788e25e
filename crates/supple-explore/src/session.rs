//! One open page: its workers, and what is pushed to it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use supple::{EvaluateOptions, Matrices, Problem};
use supple_report::scene::Stage;
use supple_study::{About, LoadedTask};

use crate::ask::{Ask, Pin, View};
use crate::curves::{curves, quantities, threads};
use crate::evaluate::{Evaluated, details};
use crate::knobs::{Knob, Turned, knobs, turned, with_parameters};
use crate::map::{Wanted, fill};
use crate::rollouts::roll_out;
use crate::save::OnScreen;
use crate::search::search;
use crate::sensor::virtual_sensor;
use crate::slot::{Job, Slot};
use crate::surroundings::Surroundings;

/// Maximum number of messages queued for a page: if it reads slowly, workers wait.
const MOST_WAITING: usize = 32;
/// A running evaluation may take this long to finish even if a newer one is requested, so that the page shows
/// intermediate designs while a slider moves.
const GRACE: Duration = Duration::from_millis(300);
/// Secondary computations wait this long after the design on screen, so that it gets all cores while a slider moves.
const REST: Duration = Duration::from_millis(100);
/// Surfaces that are kept for one page at most.
const MOST_SURFACES: usize = 300;
/// Samples of one request at most, and starts of a search.
const MOST_SAMPLES: usize = 500;

/// A task file as pages show it.
pub struct Shown {
    /// The task.
    pub loaded: LoadedTask,
    /// What can be turned.
    pub knobs: Vec<Knob>,
    /// How often the file was read.
    pub generation: u64,
}

impl Shown {
    /// A task file as it was read for the n-th time.
    pub fn new(loaded: LoadedTask, generation: u64) -> Self {
        Self { knobs: knobs(&loaded), loaded, generation }
    }
}

/// An open page.
pub struct Session {
    shown: Arc<RwLock<Arc<Shown>>>,
    surroundings: Arc<dyn Surroundings>,
    push: SyncSender<String>,
    slots: [Slot<Ask>; View::WORKERS.len()],
    /// Evaluations of the design on screen that run or wait.
    busy: AtomicUsize,
    stage: Mutex<(Stage, usize)>,
    /// The last evaluation: which reading, values and task.
    last: Mutex<Option<(Key, Arc<Evaluated>)>>,
    /// Controls of the plans at the end of the last search, of each task.
    known: Mutex<Vec<Matrices>>,
}

/// What an evaluation is of: the reading of the file, the values of all knobs, and the task that is shown.
type Key = (u64, Vec<f64>, usize);

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Session {
    /// A page with its workers, which `pushed` sends what it receives. It ends with [`close`](Self::close).
    pub fn open(
        shown: Arc<RwLock<Arc<Shown>>>,
        surroundings: Arc<dyn Surroundings>,
    ) -> (Arc<Self>, std::sync::mpsc::Receiver<String>) {
        let (push, pushed) = sync_channel(MOST_WAITING);
        let slots = View::WORKERS.map(|view| Slot::new(if view == View::Evaluate { GRACE } else { Duration::ZERO }));
        let (busy, stage, last) = (AtomicUsize::new(0), Mutex::default(), Mutex::default());
        let session = Arc::new(Self { shown, surroundings, push, slots, busy, stage, last, known: Mutex::default() });
        for (index, view) in View::WORKERS.into_iter().enumerate() {
            let session = Arc::clone(&session);
            std::thread::spawn(move || {
                while let Some(job) = session.slots[index].take() {
                    session.work(view, &job);
                }
            });
        }
        (session, pushed)
    }

    /// Ends all its work.
    pub fn close(&self) {
        self.slots.iter().for_each(Slot::close);
    }

    /// The task file as it is shown now.
    pub fn shown(&self) -> Arc<Shown> {
        Arc::clone(&self.shown.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// Takes a request.
    pub fn ask(&self, ask: Ask) {
        let slot = |name: &str| View::WORKERS.iter().position(|view| view.name() == name);
        if ask.view == View::Stop {
            if let Some(index) = slot(&ask.what) {
                self.slots[index].stop();
            }
        } else if let Some(index) = slot(ask.view.name()) {
            if let (View::Evaluate, Some(details)) = (ask.view, slot(View::Details.name())) {
                self.slots[details].stop();
            }
            self.slots[index].submit(ask.id, ask);
        }
    }

    /// Tells the page something; false where it has gone.
    pub fn tell(&self, message: &Value) -> bool {
        self.push.send(message.to_string()).is_ok()
    }

    /// What a page must know first.
    pub fn hello(&self) -> Value {
        let shown = self.shown();
        let Shown { loaded: LoadedTask { problem, phi, sources, .. }, knobs, generation } = &*shown;
        let about = About::of(problem);
        let tasks: Vec<Value> = problem
            .tasks
            .iter()
            .zip(&about.tasks)
            .map(|(task, about)| {
                let size = task.system.dimensions();
                json!({
                    "name": about.name, "steps": about.steps, "time_step": about.time_step, "weight":
                    about.information_weight, "states": size.states, "quantities": quantities(task, phi),
                })
            })
            .collect();
        json!({
            "kind": "hello",
            "generation": generation,
            "title": about.title,
            "file": sources.first().map(|source| &source.path),
            "version": env!("CARGO_PKG_VERSION"),
            "tasks": tasks,
            "knobs": knobs,
            "parameters": problem.parameters.names(),
            "initial": problem.parameters.initial(),
            "feasibility": problem.design.feasibility,
            "warnings": problem.warnings,
            "designable": !problem.parameters.design().is_empty(),
        })
    }

    /// Does one job; errors are sent to the page.
    fn work(&self, view: View, job: &Job<Ask>) {
        let shown = self.shown();
        let ask = &job.what;
        if ask.generation != shown.generation {
            return;
        }
        let began = Instant::now();
        let worker = Worker { session: self, shown: &shown, ask, stop: &job.stop, began };
        if view == View::Evaluate {
            self.busy.fetch_add(1, Ordering::Relaxed);
        }
        let entered = self.surroundings.enter();
        let done = catch_unwind(AssertUnwindSafe(|| worker.done(view)));
        drop(entered);
        if view == View::Evaluate {
            self.busy.fetch_sub(1, Ordering::Relaxed);
        }
        if let Some(why) = self.surroundings.failure() {
            return worker.answer(view, json!({ "error": why }));
        }
        match done {
            Ok(Ok(())) => {}
            Ok(Err(why)) => worker.answer(view, json!({ "error": why })),
            Err(_) => worker.answer(view, json!({ "error": "the computation failed unexpectedly" })),
        }
    }
}

/// A job of a page.
struct Worker<'a> {
    session: &'a Session,
    shown: &'a Shown,
    ask: &'a Ask,
    stop: &'a Arc<AtomicBool>,
    began: Instant,
}

impl Worker<'_> {
    fn done(&self, view: View) -> Result<(), String> {
        match view {
            View::Evaluate => self.evaluate(),
            View::Details => self.details(),
            View::Pins => self.pins(),
            View::Sensor => {
                let Turned { problem, phi } = self.turned(&self.ask.values)?;
                let sensor = virtual_sensor(&problem, &phi, self.ask.task)?;
                self.answer(view, json!({ "sensor": sensor }));
                Ok(())
            }
            View::Map => self.map(),
            View::Design => self.design(),
            View::Rollouts => self.rollouts(),
            View::Save => self.save(),
            View::Stop => Ok(()),
        }
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Has plans start also from those of the last search.
    fn inform(&self, problem: &mut Problem) {
        for (task, controls) in problem.tasks.iter_mut().zip(&*lock(&self.session.known)) {
            task.known_controls = (controls.count() == task.steps).then(|| controls.clone());
        }
    }

    /// The task, whose plans start also from those of the last search.
    fn loaded(&self) -> LoadedTask {
        let mut loaded = self.shown.loaded.clone();
        self.inform(&mut loaded.problem);
        loaded
    }

    fn turned(&self, values: &[f64]) -> Result<Turned, String> {
        let mut turned = turned(&self.shown.loaded, &self.shown.knobs, values)?;
        self.inform(&mut turned.problem);
        Ok(turned)
    }

    /// An answer, with what it answers.
    fn message(&self, view: View, mut body: Value) -> Value {
        body["kind"] = view.name().into();
        body["id"] = self.ask.id.into();
        body["generation"] = self.shown.generation.into();
        body["values"] = json!(self.ask.values);
        body["milliseconds"] = (self.began.elapsed().as_secs_f64() * 1e3).into();
        body
    }

    fn answer(&self, view: View, body: Value) {
        self.session.tell(&self.message(view, body));
    }

    /// Tells designs with their scene and curves. Surfaces that the page lacks go with them, so messages keep their order.
    fn answer_with_scene(&self, view: View, list: Vec<(String, Vec<f64>, Arc<Evaluated>)>) {
        let mut stage = lock(&self.session.stage);
        if stage.0.surfaces().len() > MOST_SURFACES {
            *stage = Default::default();
        }
        let first = stage.1;
        let designs: Vec<Value> = list
            .iter()
            .map(|(name, values, found)| {
                let scene = found.shown().and_then(|(_, task)| task.trajectory.as_ref()?.scene.as_ref());
                json!({
                    "name": name,
                    "values": values,
                    "numbers": found.numbers(),
                    "curves": curves(found, &self.ask.want),
                    "scene": scene.map(|scene| stage.0.design(name, scene)),
                })
            })
            .collect();
        stage.1 = stage.0.surfaces().len();
        let meshes = json!({ "first": first, "list": &stage.0.surfaces()[first..], "warnings": stage.0.warnings() });
        self.answer(view, json!({ "designs": designs, "meshes": meshes, "task": self.ask.task }));
    }

    /// The design on screen, or one whose plan is still known.
    fn evaluated(&self, values: &[f64], keep: bool) -> Result<Option<Arc<Evaluated>>, String> {
        let key: Key = (self.shown.generation, values.to_vec(), self.ask.task);
        if let Some((known, found)) = &*lock(&self.session.last)
            && *known == key
        {
            return Ok(Some(Arc::clone(found)));
        }
        let options = EvaluateOptions { trajectories: true, ..Default::default() };
        let found = Evaluated::of(self.turned(values)?, self.ask.task, &options, self.stop)?;
        let Some(found) = found.map(Arc::new) else { return Ok(None) };
        if keep {
            *lock(&self.session.last) = Some((key, Arc::clone(&found)));
        }
        Ok(Some(found))
    }

    fn evaluate(&self) -> Result<(), String> {
        if let Some(found) = self.evaluated(&self.ask.values, true)? {
            self.answer_with_scene(View::Evaluate, vec![("now".to_owned(), self.ask.values.clone(), found)]);
        }
        Ok(())
    }

    /// The controls of the plan on screen, where there is one task.
    fn known_controls(&self) -> Option<Matrices> {
        let last = lock(&self.session.last);
        let (key, found) = last.as_ref()?;
        let same = *key == (self.shown.generation, self.ask.values.clone(), self.ask.task);
        let trajectory = found.shown()?.1.trajectory.as_ref().filter(|_| same)?;
        Some(Matrices::of_rows(&trajectory.controls, trajectory.control_names.len()))
    }

    fn details(&self) -> Result<(), String> {
        while self.began.elapsed() < REST {
            if self.stopped() {
                return Ok(());
            }
            std::thread::sleep(REST / 20);
        }
        let at = self.turned(&self.ask.values)?;
        let controls = self.known_controls().filter(|_| at.problem.tasks.len() == 1).map(|one| vec![one]);
        if let Some(found) = details(at, controls, self.stop)? {
            self.answer(View::Details, json!({ "details": found }));
        }
        Ok(())
    }

    fn pins(&self) -> Result<(), String> {
        let mut list = Vec::new();
        for Pin { name, values } in &self.ask.pins {
            match self.evaluated(values, false) {
                Ok(Some(found)) => list.push((name.clone(), values.clone(), found)),
                Ok(None) => return Ok(()),
                Err(why) => return Err(format!("design {name}: {why}")),
            }
        }
        self.answer_with_scene(View::Pins, list);
        Ok(())
    }

    fn map(&self) -> Result<(), String> {
        let Ask { values, axes, prices, .. } = self.ask.clone();
        self.turned(&values)?;
        let [x, y] = axes;
        if x == y || x.max(y) >= self.shown.knobs.len() {
            return Err("a map needs two different sliders".to_owned());
        }
        let tell = |points: Vec<Value>, done: [usize; 2]| {
            let body = json!({ "points": points, "done": done, "axes": axes, "gaps": crate::map::GAPS });
            self.session.tell(&self.message(View::Map, body)) && !self.stopped()
        };
        let wanted = Wanted { values, axes, prices };
        fill(&self.loaded(), &self.shown.knobs, &wanted, self.stop, &self.session.busy, &tell);
        Ok(())
    }

    fn design(&self) -> Result<(), String> {
        let Turned { problem, phi } = self.turned(&self.ask.values)?;
        if problem.parameters.design().is_empty() {
            return Err("the task has no parameter with role = \"design\"".to_owned());
        }
        let task = LoadedTask { problem, phi, ..self.shown.loaded.clone() };
        let with = |design: &[f64]| json!(with_parameters(&self.shown.knobs, &self.ask.values, design));
        let tell = |mut visited: Value| {
            let design: Vec<f64> = serde_json::from_value(visited["parameters"].take()).unwrap_or_default();
            visited["design"] = with(&design);
            if !self.session.tell(&self.message(View::Design, json!({ "visited": visited }))) {
                self.stop.store(true, Ordering::Relaxed);
            }
        };
        let found = search(task, self.ask.count.min(MOST_SAMPLES), &self.session.surroundings, self.stop, &tell)?;
        let stopped = self.stopped();
        if !found.controls.is_empty() {
            *lock(&self.session.known) = found.controls;
            *lock(&self.session.last) = None;
        }
        self.answer(View::Design, json!({ "ended": found.ended, "design": with(&found.design), "stopped": stopped }));
        Ok(())
    }

    fn rollouts(&self) -> Result<(), String> {
        let Ask { task, count, .. } = *self.ask;
        let Turned { problem, phi } = self.turned(&self.ask.values)?;
        let controls = self.known_controls();
        let count = count.min(MOST_SAMPLES);
        let tell = |time: &[f64], samples: &[supple::simulate::Sample]| {
            let costs: Vec<Option<f64>> = samples.iter().map(|one| Some(one.cost).filter(|c| c.is_finite())).collect();
            let body = json!({ "costs": costs, "threads": threads(time, samples, &self.ask.want), "count": count });
            self.session.tell(&self.message(View::Rollouts, body)) && !self.stopped()
        };
        roll_out(&problem, &phi, task, count, controls.as_ref(), self.stop, &tell).map_err(|e| e.to_string())
    }

    fn save(&self) -> Result<(), String> {
        let screen = OnScreen { loaded: &self.loaded(), knobs: &self.shown.knobs, values: &self.ask.values };
        let path = match self.ask.what.as_str() {
            "result" => screen.save_result()?,
            "report" => screen.save_report()?,
            "task" => screen.save_task()?,
            "set" => {
                self.answer(View::Save, json!({ "what": "set", "text": screen.set_text() }));
                return Ok(());
            }
            other => return Err(format!("`{other}` cannot be saved; there are `result`, `report`, `task` and `set`")),
        };
        self.answer(View::Save, json!({ "what": self.ask.what, "path": path.display().to_string() }));
        Ok(())
    }
}
