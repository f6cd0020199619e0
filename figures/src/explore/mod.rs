//! An interactive page on which a flat world can be dragged, with every method's estimate of its derivative,
//! live.
//!
//! The page requests the numbers of every state from this program over the loopback address; there is no
//! other connection, and nothing leaves the machine.

mod numbers;
mod rays;
mod server;
mod state;

use std::sync::{Arc, Mutex, PoisonError};

use anyhow::Result;
use clap::Args;

use self::numbers::Numbers;
use self::server::{Answer, Server};
use self::state::State;

const PAGE: &str = include_str!("page.html");
const SCRIPT: &str = include_str!("page.js");
const STYLE: &str = include_str!("page.css");

/// A flat world to drag: image, warp field and derivative by four methods, live in the browser.
#[derive(Debug, Args)]
pub(crate) struct Options {
    /// The port of the loopback address to serve the page at; 0 for one that is free.
    #[arg(long, default_value_t = 8020)]
    port: u16,
}

/// Serves the page until the program is ended.
pub(crate) fn run(options: &Options) -> Result<()> {
    let server = Server::new(options.port)?;
    println!("Open http://{} in a browser; end with Ctrl-C.", server.address);
    serve(&Arc::new(server), vec![]);
    Ok(())
}

/// Serves the page and other files.
fn serve(server: &Arc<Server>, others: Vec<(&'static str, String)>) {
    // The numbers use all threads of the machine: one state at a time.
    let turn = Mutex::new(());
    server.serve(move |url| answer(url, &others, &turn));
}

fn answer(url: &str, others: &[(&'static str, String)], turn: &Mutex<()>) -> Answer {
    let (path, link) = url.split_once('?').unwrap_or((url, ""));
    let page = |kind, body: &str| Answer { status: 200, kind, body: body.to_owned() };
    let html = "text/html; charset=utf-8";
    match path {
        "/" => page(html, PAGE),
        "/page.js" => page("text/javascript; charset=utf-8", SCRIPT),
        "/page.css" => page("text/css; charset=utf-8", STYLE),
        "/numbers" | "/quick" => {
            let _turn = turn.lock().unwrap_or_else(PoisonError::into_inner);
            match numbers(link, path == "/quick") {
                Ok(json) => page("application/json", &json),
                Err(error) => Answer::text(400, format!("{error:#}")),
            }
        }
        _ => match others.iter().find(|(name, _)| *name == path) {
            Some((_, body)) => page(html, body),
            None => Answer::text(404, format!("there is nothing at {path}")),
        },
    }
}

fn numbers(link: &str, is_quick: bool) -> Result<String> {
    Ok(serde_json::to_string(&Numbers::new(&State::parse(link)?, is_quick)?)?)
}

#[cfg(test)]
mod tests;
