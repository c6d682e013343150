//! The page, its stream, and wishes, over HTTP on this machine alone.
//!
//! A page of another origin must neither see nor do anything here, also not by a name that leads to this machine (DNS
//! rebinding): Host and Origin of every request are checked, and a wish has to carry the token that only the printed URL
//! has. There are no cookies, so a browser adds nothing by itself to what a foreign page sends.

mod door;

use std::convert::Infallible;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::sync::mpsc::{SyncSender, TrySendError};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use std::{io, thread};

use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::{DefaultBodyLimit, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware;
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use futures_util::stream;
use serde_json::{Value, json};
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::oneshot;

use super::air::{Air, Seat, VIEWERS, event, lock};
use super::wish::{Asked, Wish};
use door::Token;

/// Longest wish, bytes.
const WISH: usize = 4096;
/// Time in which a jog begins from where the one before it leads to.
const JOG: Duration = Duration::from_millis(300);

/// Why there is no server.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The port is taken.
    #[error(
        "port {0} of this machine is in use; name another one with --port, or 0 for any that is free"
    )]
    Taken(u16),
    /// Something else is in the way.
    #[error("port {port} of this machine cannot be listened on: {source}")]
    Listen {
        /// Port.
        port: u16,
        /// Reason.
        source: io::Error,
    },
    /// The system has no random numbers, threads or sockets to give.
    #[error("the page cannot be served: {0}")]
    System(String),
}

/// What handlers share.
struct Shared {
    air: Arc<Air>,
    page: Bytes,
    /// First event of every stream.
    setup: Bytes,
    wishes: Option<SyncSender<Wish>>,
    jogged: Mutex<Option<(Instant, [f32; 4])>>,
}

/// The server, until it is dropped.
pub struct Server {
    port: u16,
    token: Token,
    _end: oneshot::Sender<Infallible>,
}

impl Server {
    /// Serves `page` on `port` of this machine, 0 for any that is free. `setup` is what a page has to know first; `wishes`
    /// go to a loop, where there is one that takes them.
    ///
    /// # Errors
    /// See [`ServeError`].
    pub fn start(
        port: u16,
        page: String,
        setup: &Value,
        air: Arc<Air>,
        wishes: Option<SyncSender<Wish>>,
    ) -> Result<Self, ServeError> {
        let failed = |source: io::Error| match source.kind() {
            io::ErrorKind::AddrInUse => ServeError::Taken(port),
            _ => ServeError::Listen { port, source },
        };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let port = listener.local_addr().map_err(failed)?.port();
        let token = Token::random().map_err(ServeError::System)?;
        let shared = Arc::new(Shared {
            air,
            page: page.into(),
            setup: event("setup", setup),
            wishes,
            jogged: Mutex::default(),
        });
        let commands = Router::new()
            .route("/do", post(wish))
            .layer(DefaultBodyLimit::max(WISH))
            .layer(middleware::from_fn_with_state(
                token.clone(),
                door::ask_for_token,
            ));
        let router = Router::new()
            .route("/", get(page_of))
            .route("/stream", get(stream_of))
            .merge(commands)
            .layer(middleware::from_fn_with_state(
                port,
                door::keep_strangers_out,
            ))
            .with_state(shared);
        let (end, ended) = oneshot::channel::<Infallible>();
        let system = |error: io::Error| ServeError::System(error.to_string());
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .build()
            .map_err(system)?;
        let serve = move || {
            runtime.block_on(async move {
                let Ok(listener) = tokio::net::TcpListener::from_std(listener) else {
                    return;
                };
                tokio::spawn(async move { axum::serve(listener, router).await });
                // Until the server is dropped; with the runtime all that still runs in it ends.
                let _ = ended.await;
            });
        };
        thread::Builder::new()
            .name("page".into())
            .spawn(serve)
            .map_err(system)?;
        Ok(Self {
            port,
            token,
            _end: end,
        })
    }

    /// Address.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        (Ipv4Addr::LOCALHOST, self.port).into()
    }

    /// The URL that may ask for something. The part after # stays in the browser.
    #[must_use]
    pub fn url(&self) -> String {
        format!("http://{}/#{}", self.address(), self.token.text())
    }
}

async fn page_of(State(shared): State<Arc<Shared>>) -> Response {
    let html = HeaderValue::from_static("text/html; charset=utf-8");
    ([(header::CONTENT_TYPE, html)], shared.page.clone()).into_response()
}

async fn stream_of(State(shared): State<Arc<Shared>>) -> Response {
    let Some(seat) = Seat::take(&shared.air) else {
        return sentence(
            StatusCode::SERVICE_UNAVAILABLE,
            &format!("{VIEWERS} viewers are looking already; close a page"),
        );
    };
    let (mut first, receiver) = shared.air.tune_in();
    first.push_front(shared.setup.clone());
    let texts = stream::unfold(
        (seat, first, receiver),
        |(seat, mut first, mut receiver)| async {
            if let Some(text) = first.pop_front() {
                return Some((Ok::<_, Infallible>(text), (seat, first, receiver)));
            }
            loop {
                match receiver.recv().await {
                    Ok(text) => return Some((Ok(text), (seat, first, receiver))),
                    // What this viewer was too slow for is gone; it goes on with the oldest that is left.
                    Err(RecvError::Lagged(_)) => {}
                    Err(RecvError::Closed) => return None,
                }
            }
        },
    );
    let kind = HeaderValue::from_static("text/event-stream");
    ([(header::CONTENT_TYPE, kind)], Body::from_stream(texts)).into_response()
}

async fn wish(State(shared): State<Arc<Shared>>, body: Bytes) -> Response {
    let Some(wishes) = &shared.wishes else {
        return sentence(
            StatusCode::CONFLICT,
            "this bus is only watched; without --bus the page runs a bench of its own",
        );
    };
    let wish = match understood(&shared, &body) {
        Ok(wish) => wish,
        Err(why) => return sentence(StatusCode::BAD_REQUEST, &why),
    };
    match wishes.try_send(wish) {
        Ok(()) => StatusCode::NO_CONTENT.into_response(),
        Err(TrySendError::Full(_)) => sentence(
            StatusCode::SERVICE_UNAVAILABLE,
            "the bench has not yet taken what was asked for before; ask again",
        ),
        Err(TrySendError::Disconnected(_)) => {
            sentence(StatusCode::SERVICE_UNAVAILABLE, "the bench has ended")
        }
    }
}

fn understood(shared: &Shared, body: &[u8]) -> Result<Wish, String> {
    let asked: Asked =
        serde_json::from_slice(body).map_err(|error| format!("not understood: {error}"))?;
    if let Asked::Push { .. } = asked {
        return asked.jog(shared.air.stands()).map(|(wish, _)| wish);
    }
    if !matches!(asked, Asked::Jog { .. }) {
        *lock(&shared.jogged) = None;
        return asked.wish();
    }
    let mut jogged = lock(&shared.jogged);
    let stand = match *jogged {
        Some((when, target)) if when.elapsed() < JOG => Some(target),
        _ => shared.air.stands(),
    };
    let (wish, target) = asked.jog(stand)?;
    *jogged = Some((Instant::now(), target));
    Ok(wish)
}

/// A refusal in words.
fn sentence(status: StatusCode, text: &str) -> Response {
    let body = json!({ "error": text }).to_string();
    let kind = HeaderValue::from_static("application/json");
    (status, [(header::CONTENT_TYPE, kind)], body).into_response()
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead as _, BufReader, Write as _};
    use std::net::TcpStream;
    use std::sync::Arc;

    use serde_json::json;

    use super::{Air, Server};

    /// More than all buffers between a server and a viewer can hold.
    const TEXTS: usize = 20_000;
    const LENGTH: usize = 10_000;

    #[test]
    fn a_viewer_that_does_not_read_holds_up_nobody_and_goes_on_with_what_is_new() {
        let air = Arc::new(Air::default());
        let server = Server::start(0, String::new(), &json!({}), Arc::clone(&air), None).unwrap();
        let mut viewer = TcpStream::connect(server.address()).unwrap();
        write!(
            viewer,
            "GET /stream HTTP/1.1\r\nHost: {}\r\n\r\n",
            server.address()
        )
        .unwrap();
        while !air.is_seen() {
            std::thread::yield_now();
        }
        let filling = "-".repeat(LENGTH);
        for number in 0..TEXTS {
            air.show("text", &json!({ "number": number, "filling": filling }));
        }
        air.show("text", &json!({ "number": "last" }));
        let mut seen = 0;
        for line in BufReader::new(viewer).lines() {
            let line = line.unwrap();
            if line.contains("\"last\"") {
                break;
            }
            seen += usize::from(line.starts_with("data: "));
        }
        assert!((1..TEXTS / 2).contains(&seen), "{seen} of {TEXTS} texts");
    }
}
