//! Who may come in: requests from this machine's own pages, and wishes with the token.

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::Response;
use sha2::{Digest, Sha256};

use super::sentence;

/// Bytes of a token.
const LENGTH: usize = 24;

/// The secret of a URL.
#[derive(Clone, Debug)]
pub(super) struct Token(String);

impl Token {
    /// A new one.
    ///
    /// # Errors
    /// The system has no random numbers.
    pub(super) fn random() -> Result<Self, String> {
        let mut bytes = [0; LENGTH];
        getrandom::fill(&mut bytes).map_err(|error| format!("no random numbers: {error}"))?;
        Ok(Self(
            bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
        ))
    }

    /// As the URL has it.
    pub(super) fn text(&self) -> &str {
        &self.0
    }

    /// Whether this is it. How long the comparison takes says nothing of the token: it is of hashes.
    fn is(&self, other: &str) -> bool {
        Sha256::digest(&self.0) == Sha256::digest(other)
    }
}

/// Names of this machine to itself, with a port.
fn is_own(authority: &str, port: u16) -> bool {
    ["127.0.0.1", "localhost"]
        .iter()
        .any(|name| authority == format!("{name}:{port}"))
}

/// Why a request is refused, if it is.
fn refusal(headers: &HeaderMap, port: u16) -> Option<String> {
    let text = |name: HeaderName| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
    let host = text(header::HOST).unwrap_or("none");
    if !is_own(host, port) {
        return Some(format!(
            "this page answers to 127.0.0.1:{port} and localhost:{port}, and the request is for {host}"
        ));
    }
    let origin = text(header::ORIGIN)?;
    let own = origin
        .strip_prefix("http://")
        .is_some_and(|authority| is_own(authority, port));
    (!own).then(|| {
        format!("the request comes from {origin}; only the page of this program may ask for anything here")
    })
}

/// Refuses requests for another Host, and those from another Origin.
pub(super) async fn keep_strangers_out(
    State(port): State<u16>,
    request: Request,
    next: Next,
) -> Response {
    let mut response = match refusal(request.headers(), port) {
        Some(why) => sentence(StatusCode::FORBIDDEN, &why),
        None => next.run(request).await,
    };
    for (name, value) in [
        (header::CACHE_CONTROL, "no-store"),
        (header::CONTENT_SECURITY_POLICY, "frame-ancestors 'none'"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (
            HeaderName::from_static("cross-origin-resource-policy"),
            "same-origin",
        ),
    ] {
        response
            .headers_mut()
            .insert(name, HeaderValue::from_static(value));
    }
    response
}

/// Refuses requests without the token.
pub(super) async fn ask_for_token(
    State(token): State<Token>,
    request: Request,
    next: Next,
) -> Response {
    let given = request
        .headers()
        .get(header::AUTHORIZATION)
        .and_then(|value| value.to_str().ok()?.strip_prefix("Bearer "));
    match given {
        Some(given) if token.is(given) => next.run(request).await,
        Some(_) => sentence(
            StatusCode::UNAUTHORIZED,
            "the token is that of another run; open the URL that plant-sim view has printed now",
        ),
        None => sentence(
            StatusCode::UNAUTHORIZED,
            "whoever asks for something needs the token of the URL that plant-sim view has printed; open that one",
        ),
    }
}
