//! A page on which a flat world can be dragged, and what every method finds of its derivative, live.
//!
//! The page asks this program for the numbers of every state, over the loopback address; nothing else is reached, and nothing leaves the
//! machine.

mod numbers;
mod state;

use std::net::Ipv4Addr;
use std::sync::Arc;
use std::thread;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use tiny_http::{Header, Response, Server};

use self::numbers::Numbers;
use self::state::State;

const PAGE: &str = include_str!("page.html");
const SCRIPT: &str = include_str!("page.js");
const STYLE: &str = include_str!("page.css");

/// Requests that are answered at once.
const THREADS: usize = 2;

/// A flat world to drag: image, warp field and derivative by four methods, live in the browser.
#[derive(Debug, Args)]
pub(crate) struct Options {
    /// The port of the loopback address to serve the page at; 0 for one that is free.
    #[arg(long, default_value_t = 8020)]
    port: u16,
}

/// Serves the page until the program is ended.
pub(crate) fn run(options: &Options) -> Result<()> {
    let server = listen(options.port)?;
    println!("Open http://{} in a browser; end with Ctrl-C.", server.server_addr());
    serve(&Arc::new(server), &[]);
    Ok(())
}

fn listen(port: u16) -> Result<Server> {
    let server = Server::http((Ipv4Addr::LOCALHOST, port)).map_err(|error| anyhow!(error));
    server.with_context(|| {
        format!("cannot listen at port {port}; another one is chosen by --port, and a free one by --port 0")
    })
}

/// Answers requests, for pages besides ours as well.
fn serve(server: &Arc<Server>, besides: &[(&'static str, String)]) {
    thread::scope(|scope| {
        for _ in 0..THREADS {
            scope.spawn(|| {
                for request in server.incoming_requests() {
                    let (status, kind, body) = answer(request.url(), besides);
                    let header = Header::from_bytes("Content-Type", kind).into_iter();
                    let response = header
                        .fold(Response::from_string(body).with_status_code(status), Response::with_header);
                    // Who asked may have gone.
                    let _ = request.respond(response);
                }
            });
        }
    });
}

/// Status, kind and text of what a path leads to.
fn answer(url: &str, besides: &[(&'static str, String)]) -> (u16, &'static str, String) {
    let (path, link) = url.split_once('?').unwrap_or((url, ""));
    let html = "text/html; charset=utf-8";
    match path {
        "/" => (200, html, PAGE.to_owned()),
        "/page.js" => (200, "text/javascript; charset=utf-8", SCRIPT.to_owned()),
        "/page.css" => (200, "text/css; charset=utf-8", STYLE.to_owned()),
        "/numbers" => match numbers(link) {
            Ok(json) => (200, "application/json", json),
            Err(error) => (400, "text/plain; charset=utf-8", format!("{error:#}")),
        },
        _ => match besides.iter().find(|(name, _)| *name == path) {
            Some((_, page)) => (200, html, page.clone()),
            None => (404, "text/plain; charset=utf-8", format!("there is nothing at {path}")),
        },
    }
}

fn numbers(link: &str) -> Result<String> {
    Ok(serde_json::to_string(&Numbers::new(&State::parse(link)?)?)?)
}

#[cfg(test)]
mod tests;
