//! Checks that the tests notice mistakes: builds a copy of the workspace with all mutations of
//! `tests/mutations`, each behind a switch, and runs for each one the tests that should fail. `cargo run
//! --release -p tests --example mutations`
//!
//! The copy is in `target/mutations`. It is built once for all mutations that do not overlap, and tests run
//! as under `cargo test --release --workspace`. Without a mutation they must pass; with it at least one must
//! fail. The table of results is in `tests/mutations/README.md`.
//!
//! - `NAME …`: these mutations alone; the table keeps the rows of the others
//! - `--list`: lists the mutations and whether they apply, and builds nothing

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use tests::mutations::{Batch, Mutation, VARIABLE, all, batches, root};
use tests::results;

/// A test program that runs longer than this has failed.
const LONGEST: Duration = Duration::from_secs(1200);

type Result<T> = std::result::Result<T, String>;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(survivors) => {
            eprintln!("{survivors} mutations were not noticed, or could not be tried");
            ExitCode::FAILURE
        }
        Err(fault) => {
            eprintln!("{fault}");
            ExitCode::FAILURE
        }
    }
}

/// Result of running a mutation's tests.
struct Outcome {
    number: usize,
    /// The tests that failed.
    caught_by: Vec<String>,
    seconds: f64,
}

fn run(arguments: &[String]) -> Result<usize> {
    let (options, names): (Vec<_>, Vec<_>) = arguments.iter().partition(|a| a.starts_with("--"));
    let mutations = all()?;
    if let Some(unknown) = names.iter().find(|name| mutations.iter().all(|m| m.name != ***name)) {
        return Err(format!("no mutation is called {unknown}"));
    }
    let all_batches = batches(&mutations)?;
    match options.as_slice() {
        [] => {}
        [list] if *list == "--list" => {
            mutations.iter().for_each(|m| println!("{}: {}", m.name, m.what));
            println!("{} mutations in {} builds", mutations.len(), all_batches.len());
            return Ok(0);
        }
        _ => return Err(format!("unknown option: {options:?}; there is --list")),
    }
    let is_wanted = |number: &usize| names.is_empty() || names.contains(&&mutations[number - 1].name);
    let (mut outcomes, mut unknown) = (vec![], 0);
    for batch in &all_batches {
        let numbers: Vec<usize> = batch.numbers.iter().copied().filter(is_wanted).collect();
        if numbers.is_empty() {
            continue;
        }
        let copy = copied(batch)?;
        let programs = built(&copy, numbers.iter().map(|n| &mutations[n - 1]))?;
        let mut right: HashMap<&str, bool> = HashMap::new();
        for number in numbers {
            let mutation = &mutations[number - 1];
            let mut all_right = true;
            for tests in &mutation.tests {
                let passes = match right.get(tests.as_str()) {
                    Some(&passes) => passes,
                    None => {
                        let failed = run_tests(&copy, &programs, tests, 0)?;
                        if !failed.is_empty() {
                            eprintln!("`{tests}` fails without a mutation: {failed:?}");
                        }
                        failed.is_empty()
                    }
                };
                right.insert(tests, passes);
                all_right &= passes;
            }
            if !all_right {
                unknown += 1;
                continue;
            }
            outcomes.push(judged(&copy, &programs, mutation, number)?);
            show(&mutations, outcomes.last().expect("just pushed"));
            // Written at once: completed results are kept if a later mutation fails to run.
            write_table(&mutations, &outcomes);
        }
    }
    Ok(unknown + outcomes.iter().filter(|outcome| outcome.caught_by.is_empty()).count())
}

/// Runs tests until one fails.
fn judged(copy: &Path, programs: &Programs, mutation: &Mutation, number: usize) -> Result<Outcome> {
    let start = Instant::now();
    let mut caught_by = vec![];
    for tests in &mutation.tests {
        caught_by = run_tests(copy, programs, tests, number)?;
        if !caught_by.is_empty() {
            break;
        }
    }
    Ok(Outcome { number, caught_by, seconds: start.elapsed().as_secs_f64() })
}

fn show(mutations: &[Mutation], Outcome { number, caught_by, seconds }: &Outcome) {
    let Mutation { name, what, .. } = &mutations[number - 1];
    let by = if caught_by.is_empty() { "NOT NOTICED".to_owned() } else { caught_by.join(", ") };
    println!("{name} ({what}): {by}, {seconds:.0} s");
}

/// The workspace with the mutations of a batch.
fn copied(batch: &Batch) -> Result<PathBuf> {
    let (from, to) = (root(), root().join("target/mutations/workspace"));
    let listed = Command::new("git")
        .args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"])
        .current_dir(&from)
        .output()
        .map_err(|e| format!("git: {e}"))?;
    if !listed.status.success() {
        return Err(format!("git ls-files: {}", String::from_utf8_lossy(&listed.stderr)));
    }
    let names = String::from_utf8_lossy(&listed.stdout).into_owned();
    let mut kept = BTreeSet::new();
    for name in names.split('\0').filter(|name| !name.is_empty()) {
        let (path, place) = (from.join(name), to.join(name));
        // A removed file is still listed.
        let Ok(bytes) = std::fs::read(&path) else { continue };
        let bytes = match String::from_utf8(bytes) {
            Ok(text) if name.ends_with(".rs") => batch.patched(name, &text).into_bytes(),
            Ok(text) => text.into_bytes(),
            Err(other) => other.into_bytes(),
        };
        // Unchanged files keep their times, and are not rebuilt.
        if std::fs::read(&place).ok().as_ref() != Some(&bytes) {
            let folder = place.parent().expect("a folder");
            std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
            std::fs::write(&place, bytes).map_err(|e| format!("{}: {e}", place.display()))?;
        }
        kept.insert(place);
    }
    for old in sources(&to).into_iter().filter(|path| !kept.contains(path)) {
        std::fs::remove_file(&old).map_err(|e| format!("{}: {e}", old.display()))?;
    }
    Ok(to)
}

/// All files below a folder.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(std::result::Result::ok);
    entries
        .flat_map(|entry| {
            let path = entry.path();
            if path.is_dir() { sources(&path) } else { vec![path] }
        })
        .collect()
}

/// Test programs by package and target, `--lib` or `--test NAME`.
type Programs = BTreeMap<(String, String), PathBuf>;

/// Package, target and filters of `tests --test unbiased edge_sampling`.
fn parts(tests: &str) -> Result<(String, String, Vec<&str>)> {
    let words: Vec<&str> = tests.split_whitespace().collect();
    match words.as_slice() {
        [package, "--lib", filters @ ..] => Ok(((*package).to_owned(), "--lib".to_owned(), filters.to_vec())),
        [package, "--test", name, filters @ ..] => {
            Ok(((*package).to_owned(), format!("--test {name}"), filters.to_vec()))
        }
        _ => Err(format!("`{tests}` is not a package with --lib or --test NAME, and filters")),
    }
}

fn cargo(copy: &Path) -> Command {
    let mut cargo = Command::new(std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned()));
    cargo.current_dir(copy).env("CARGO_TARGET_DIR", root().join("target/mutations/build"));
    cargo.env("CARGO_PROFILE_RELEASE_DEBUG", "false");
    cargo
}

/// Builds the test programs of some mutations.
fn built<'m>(copy: &Path, mutations: impl Iterator<Item = &'m Mutation>) -> Result<Programs> {
    let mut wanted = BTreeSet::new();
    for tests in mutations.flat_map(|mutation| &mutation.tests) {
        let (package, target, _) = parts(tests)?;
        wanted.insert((package, target));
    }
    // All packages together: each selection of packages would have other dependency features.
    let packages =
        wanted.iter().map(|(package, _)| package.as_str()).chain(["flatland", "volume3d", "tests"]);
    let mut arguments: BTreeSet<String> = packages.map(|package| format!("-p {package}")).collect();
    arguments.extend(wanted.iter().map(|(_, target)| target.clone()));
    let arguments: Vec<&str> = arguments.iter().flat_map(|argument| argument.split(' ')).collect();
    println!("cargo test --release --no-run {}", arguments.join(" "));
    let start = Instant::now();
    let output = cargo(copy)
        .args(["test", "--release", "--no-run", "--message-format=json-render-diagnostics"])
        .args(&arguments)
        .stderr(Stdio::inherit())
        .output()
        .map_err(|e| format!("cargo: {e}"))?;
    if !output.status.success() {
        return Err("the copy does not build".to_owned());
    }
    println!("built in {:.0} s", start.elapsed().as_secs_f64());
    let mut programs = Programs::new();
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        let Ok(message) = serde_json::from_str::<serde_json::Value>(line) else { continue };
        let (Some(program), Some(manifest)) =
            (message["executable"].as_str(), message["manifest_path"].as_str())
        else {
            continue;
        };
        let package = Path::new(manifest).parent().and_then(Path::file_name).expect("a package's folder");
        let target = match message["target"]["kind"][0].as_str() {
            Some("lib") => "--lib".to_owned(),
            Some("test") => format!("--test {}", message["target"]["name"].as_str().unwrap_or_default()),
            _ => continue,
        };
        programs.insert((package.to_string_lossy().into_owned(), target), PathBuf::from(program));
    }
    match wanted.iter().find(|key| !programs.contains_key(*key)) {
        Some((package, target)) => Err(format!("there is no test program {package} {target}")),
        None => Ok(programs),
    }
}

/// The tests that fail with a mutation.
fn run_tests(copy: &Path, programs: &Programs, tests: &str, number: usize) -> Result<Vec<String>> {
    let (package, target, filters) = parts(tests)?;
    let program = &programs[&(package.clone(), target.clone())];
    let output = root().join("target/mutations/output");
    let file = std::fs::File::create(&output).map_err(|e| format!("{}: {e}", output.display()))?;
    let mut child = Command::new(program)
        .args(&filters)
        .current_dir(copy.join(&package))
        .env("CARGO_MANIFEST_DIR", copy.join(&package))
        .env(VARIABLE, number.to_string())
        .env_remove("WARPED_AREA_TESTS")
        .env_remove("UPDATE_RESULTS")
        .stdin(Stdio::null())
        .stdout(file)
        .stderr(Stdio::null())
        .spawn()
        .map_err(|e| format!("{}: {e}", program.display()))?;
    let start = Instant::now();
    let status = loop {
        match child.try_wait().map_err(|e| e.to_string())? {
            Some(status) => break status,
            None if start.elapsed() > LONGEST => {
                child.kill().and_then(|()| child.wait()).map_err(|e| e.to_string())?;
                return Ok(vec![format!("{target} {}, which does not end", filters.join(" "))]);
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    let text = std::fs::read_to_string(&output).map_err(|e| format!("{}: {e}", output.display()))?;
    if text.contains("\nrunning 0 tests") {
        return Err(format!("`{tests}` are no tests"));
    }
    let place = if target == "--lib" { package } else { target.trim_start_matches("--test ").to_owned() };
    let failed = |line: &str| {
        let name = line.strip_prefix("test ")?.strip_suffix(" ... FAILED")?;
        Some(format!("{place}::{}", name.trim_end_matches(" - should panic")))
    };
    let failed: Vec<String> = text.lines().filter_map(failed).collect();
    match (status.success(), failed.is_empty()) {
        // It was killed, or overflowed its stack.
        (false, true) => Ok(vec![format!("{place}, which ends with {status}")]),
        _ => Ok(failed),
    }
}

fn write_table(mutations: &[Mutation], outcomes: &[Outcome]) {
    let file = root().join("tests/mutations/README.md");
    let mut rows: BTreeMap<String, String> = BTreeMap::new();
    for row in results::shown_in(&file, "mutation table").lines().skip(2) {
        if let Some(name) = row.split('|').nth(1) {
            rows.insert(name.trim().to_owned(), format!("{row}\n"));
        }
    }
    for outcome in outcomes {
        let Mutation { name, what, file, .. } = &mutations[outcome.number - 1];
        let by = match outcome.caught_by.as_slice() {
            [] => "**nothing**".to_owned(),
            [first] => format!("`{first}`"),
            [first, others @ ..] => format!("`{first}` and {} more", others.len()),
        };
        rows.insert(name.clone(), format!("| {name} | {what} | `{file}` | {by} |\n"));
    }
    let known = mutations.iter().filter_map(|mutation| rows.get(&mutation.name));
    let table: String = known.map(String::as_str).collect();
    let head = "| mutation | what is wrong | where | noticed by |\n|---|---|---|---|\n";
    results::fill_in(&file, "mutation table", &format!("{head}{table}"));
}
