//! The page's server, and the page in a browser where the machine has one.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Command;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use super::*;

/// Drags the occluder on the page in a frame, and writes what the page shows afterwards.
const PROBE: &str = r##"<!DOCTYPE html><body><iframe id="page" style="width:900px;height:1200px"></iframe><pre id="found"></pre><script>
const frame = document.getElementById("page"), wait = time => new Promise(done => setTimeout(done, time));
frame.onload = async () => {
  const page = frame.contentDocument, world = page.getElementById("world");
  const rows = () => [...page.querySelectorAll("#methods tbody tr:not(.exact)")].map(row => row.children[2].textContent);
  for (let i = 0; i < 200 && !rows().length; i++) await wait(50);
  const box = world.getBoundingClientRect();
  const at = (x, y) => ({ clientX: box.left + x / 10 * box.width, clientY: box.top + (6.8 - y) / 7.2 * box.height, pointerId: 1, bubbles: true });
  const drag = async (from, to) => {
    const before = page.body.dataset.shown;
    world.dispatchEvent(new frame.contentWindow.PointerEvent("pointerdown", at(...from)));
    world.dispatchEvent(new frame.contentWindow.PointerEvent("pointermove", at(...to)));
    world.dispatchEvent(new frame.contentWindow.PointerEvent("pointerup", at(...to)));
    for (let i = 0; i < 400 && (!page.body.dataset.shown || page.body.dataset.shown == before); i++) await wait(50);
  };
  // Beyond its limits a handle stays at them.
  await drag([4.9, 1.8], [9.9, 6.7]);
  const limits = frame.contentWindow.location.hash, error = page.getElementById("error").textContent;
  await drag([8, 4.6], [6, 2.5]);
  let wide = "";
  for (const width of [400, 900, 1400]) {
    frame.style.width = width + "px";
    await wait(200);
    if (page.documentElement.scrollWidth > frame.clientWidth) wide += width + " pixels: too wide ";
  }
  document.getElementById("found").textContent = [limits, frame.contentWindow.location.hash, ...rows(), wide, error].join("\n");
};
frame.src = "/";
</script>"##;

/// A server in its own thread, which runs until the test is over.
fn served(besides: Vec<(&'static str, String)>) -> (Arc<Server>, String) {
    let server = Arc::new(Server::new(0).unwrap());
    let address = server.address.to_string();
    let copy = Arc::clone(&server);
    thread::spawn(move || serve(&copy, besides));
    (server, address)
}

/// Status and body at a path.
fn get(address: &str, path: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n").unwrap();
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    let (head, body) = text.split_once("\r\n\r\n").unwrap();
    (head[9..12].parse().unwrap(), body.to_owned())
}

#[test]
fn paths_lead_to_pages_numbers_and_errors() {
    let (server, address) = served(vec![]);
    for path in ["/", "/page.js", "/page.css"] {
        assert_eq!(get(&address, path).0, 200, "{path}");
    }
    let (status, body) = get(&address, "/quick?samples=8&ox=5");
    assert!(status == 200 && body.contains("\"link\":\"ox=5&") && body.contains("warped area"), "{body}");
    let (status, body) = get(&address, "/numbers?samples=7");
    assert_eq!((status, body.as_str()), (400, "samples = 7 is not between 8 and 1024"));
    assert_eq!(get(&address, "/etc/passwd").0, 404);
    server.stop();
}

/// The status of an answer to these bytes.
fn status(address: &str, request: &[u8]) -> u16 {
    let mut stream = TcpStream::connect(address).unwrap();
    // The server may have answered before all is written.
    let _ = stream.write_all(request);
    let mut answer = [0; 12];
    stream.read_exact(&mut answer).unwrap();
    std::str::from_utf8(&answer[9..]).unwrap().parse().unwrap()
}

/// The page survives clients that send too much, nonsense, or nothing at all.
#[test]
fn clients_cannot_stop_the_server() {
    let (server, address) = served(vec![]);
    let request =
        |line: &str, more: &str| format!("{line} HTTP/1.1\r\nHost: {address}\r\n{more}\r\nx").into_bytes();
    for (bytes, expected) in [
        (request("POST /", "Content-Length: 99999999999\r\n"), 405),
        (request("GET /", "Content-Length: 18446744073709551615\r\n"), 200),
        (request("DELETE /", ""), 405),
        (request(&format!("GET /{}", "a".repeat(1 << 20)), ""), 431),
        (request("GET /", &"A: b\r\n".repeat(100)), 431),
        (b"GET / HTTP/1.1\r\nHost: example.org\r\n\r\n".to_vec(), 421),
        (b"GET / HTTP/1.1\r\n\r\n".to_vec(), 421),
        (b"\x16\x03\x01 nonsense \r\n\r\n".to_vec(), 400),
    ] {
        assert_eq!(status(&address, &bytes), expected, "{}", String::from_utf8_lossy(&bytes[..20]));
    }
    // It also survives clients that are silent, or do not read their answer.
    let silent: Vec<TcpStream> = (0..32).map(|_| TcpStream::connect(&address).unwrap()).collect();
    for mut stream in &silent[..16] {
        stream.write_all(&request("GET /", "")).unwrap();
    }
    let start = Instant::now();
    assert_eq!(get(&address, "/").0, 200);
    assert!(start.elapsed() < Duration::from_secs(4));
    server.stop();
}

#[test]
fn what_is_dragged_shows_the_numbers_of_the_library() {
    let names = std::env::var("CHROMIUM")
        .into_iter()
        .chain(["chromium", "chromium-browser", "google-chrome"].map(String::from));
    let runs =
        |name: &String| Command::new(name).arg("--version").output().is_ok_and(|out| out.status.success());
    let Some(browser) = names.into_iter().find(runs) else {
        println!("no Chromium here, and none in the variable CHROMIUM: the page was not dragged");
        return;
    };
    let (server, address) = served(vec![("/probe", PROBE.to_owned())]);
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--timeout=60000"])
        .args(["--virtual-time-budget=60000", "--window-size=1000,1300", "--dump-dom"])
        .arg(format!("http://{address}/probe"))
        .output()
        .unwrap();
    server.stop();
    let (dom, log) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let found = dom.split_once("id=\"found\">").and_then(|(_, rest)| rest.split_once("</pre>")).unwrap().0;
    let mut lines = found.lines();
    let mut link = || lines.next().unwrap().trim_start_matches('#').replace("&amp;", "&");
    let limits = link();
    assert!(limits.contains("ox=8&") && limits.contains("oy=4.6&"), "{limits}");
    let link = link();
    let state = State::parse(&link).unwrap();
    let moved = serde_json::to_value(&link).unwrap();
    assert!(link.contains("ox=6") || link.contains("ox=5.9"), "{moved}");
    let numbers: serde_json::Value = serde_json::to_value(Numbers::new(&state, false).unwrap()).unwrap();
    for method in numbers["methods"].as_array().unwrap() {
        let [slope, error] = ["slope", "slope_error"].map(|key| method[key].as_f64().unwrap());
        assert_eq!(lines.next(), Some(format!("{slope:.3} ± {error:.3}").as_str()), "{method}");
    }
    assert_eq!(lines.collect::<String>(), "", "{found}");
    assert!(!log.contains("CONSOLE"), "{log}");
}
