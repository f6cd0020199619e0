//! Steps in tasks that are run in another order, in other threads, or not at all.

use std::num::NonZeroUsize;

use super::super::parts::{Part, PartsError, Step, Task};
use super::tests::{fit, lit, objective, reverse};
use super::{Fit, FitError, Told};
use crate::gradient::Progress;
use crate::gradient::tests::comparisons::statistics;
use crate::optimize::Parameters;
use crate::scene::Scene;

fn chunked(scene: &mut Scene, chunks: usize) -> Fit {
    let mut fit = fit(scene, 4);
    fit.plan.views_per_step = 2;
    fit.in_chunks(NonZeroUsize::new(chunks).unwrap())
}

/// Runs a task in a thread and a scene of its own; task and part travel as bytes.
fn elsewhere(task: &Task, fit: &Fit) -> Part {
    let bytes = postcard::to_stdvec(task).unwrap();
    let run = || {
        let (task, mut scene): (Task, Scene) = (postcard::from_bytes(&bytes).unwrap(), lit());
        let none = Progress::none();
        let part = task.run(&mut scene, &fit.objective, &fit.parameters, &reverse, &none).unwrap();
        postcard::to_stdvec(&part).unwrap()
    };
    let bytes = std::thread::scope(|scope| scope.spawn(run).join().unwrap());
    postcard::from_bytes(&bytes).unwrap()
}

/// Parts that ran in reverse order, each in its own thread and scene, lead to the same bits as steps here. One
/// that is lost, doubled, or of the step before is refused, and the fit goes on as if it had not been sent.
#[test]
fn parts_may_run_anywhere_and_must_all_arrive() {
    for chunks in [1, 3] {
        let (mut here, mut there) = (lit(), lit());
        let (mut whole, mut asked) = (chunked(&mut here, chunks), chunked(&mut there, chunks));
        let mut before: Option<Part> = None;
        for _ in 0..4 {
            whole.step(&mut here, &reverse, &Progress::none()).unwrap();
            loop {
                let parts: Vec<Part> = asked.ask().iter().rev().map(|task| elsewhere(task, &asked)).collect();
                assert_eq!(parts.len(), 2 * chunks);
                let mut refused = |parts: Vec<Part>| {
                    let state = asked.state().clone();
                    let found = asked.tell(&mut there, parts);
                    assert_eq!(*asked.state(), state);
                    found
                };
                let found = refused(parts[1..].to_vec());
                assert!(matches!(found, Err(FitError::Parts(PartsError::Missing { .. }))), "{found:?}");
                let found = refused([&parts[..], &parts[..1]].concat());
                assert!(matches!(found, Err(FitError::Parts(PartsError::Doubled { .. }))), "{found:?}");
                if let Some(old) = before.replace(parts[0].clone()) {
                    let found = refused([&[old], &parts[1..]].concat());
                    assert_eq!(found, Err(FitError::Parts(PartsError::Other { index: 0 })));
                }
                if asked.tell(&mut there, parts).unwrap() == Told::Step {
                    break;
                }
            }
            assert_eq!(asked.state(), whole.state(), "{chunks} chunks");
        }
        assert!(asked.ask().is_empty());
    }
}

/// The gradient of three chunks has the mean of that of one. Standard errors below 4 % of the mean, as is
/// asserted, show a bias of 16 %; chunks that were summed and not averaged would be 200 % off.
#[test]
fn chunks_do_not_change_the_mean() {
    let mut scene = lit();
    let parameters = Parameters::new(&scene, &["white.reflectance"]).unwrap();
    let x = [0.4, 0.5, 0.6];
    let objective = objective(&mut scene);
    parameters.apply(&x, &mut scene).unwrap();
    let mut sums = |chunks: usize, count: u64| -> Vec<f64> {
        let mut sum = |seed| {
            let views = vec![0, 1];
            let (objective, parameters, x) = (&objective, &parameters, &x[..]);
            let step = Step { objective, parameters, x, views, seed, chunks, pace: None };
            let mut run = |task: Task| {
                task.run_at(&mut scene, objective, parameters, &reverse, &Progress::none()).unwrap()
            };
            let mut parts: Vec<Part> = step.tasks(None).into_iter().map(&mut run).collect();
            let mut compared = None;
            if chunks > 1 {
                compared = Some(step.compare(&mut scene, &parts).unwrap());
                let mut run = |task: Task| {
                    task.run_at(&mut scene, objective, parameters, &reverse, &Progress::none()).unwrap()
                };
                parts = step.tasks(compared.as_ref()).into_iter().map(&mut run).collect();
            }
            step.total(&scene, &parts, compared.as_ref()).unwrap().gradient.iter().sum()
        };
        (0..count).map(&mut sum).collect()
    };
    let (one, three) = (statistics(&sums(1, 400)), statistics(&sums(3, 400)));
    let error = one.1.hypot(three.1);
    assert!(error < 0.04 * one.0.abs(), "{one:?} {three:?}");
    assert!((one.0 - three.0).abs() < 4.0 * error, "{one:?} {three:?}");
}
