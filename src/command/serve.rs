//! Hands the window out as a web page: the folder that `.ci/web` builds, to browsers.

use std::fs::File;
use std::io::Write as _;
use std::net::{IpAddr, SocketAddr};
use std::path::{Component, Path, PathBuf};
use std::time::UNIX_EPOCH;

use clap::Args;
use tiny_http::{Header, Method, Request, Response, Server};

use super::failure::Failure;
use super::{CommandResult, Stop};

/// The page's program: a folder without it is none.
const PROGRAM: &str = "sindyscope_bg.wasm";

/// What a file is to a browser, by its ending.
const KINDS: [(&str, &str); 7] = [
    ("html", "text/html; charset=utf-8"),
    ("js", "text/javascript; charset=utf-8"),
    ("wasm", "application/wasm"),
    ("svg", "image/svg+xml"),
    ("png", "image/png"),
    ("json", "application/json"),
    ("csv", "text/csv; charset=utf-8"),
];

/// What every answer says. The first two isolate the page from others, without which a browser gives it one thread only; the
/// third has the browser ask each time whether a file has changed.
const HEADERS: [(&str, &str); 5] = [
    ("Cross-Origin-Opener-Policy", "same-origin"),
    ("Cross-Origin-Embedder-Policy", "require-corp"),
    ("Cache-Control", "no-cache"),
    ("X-Content-Type-Options", "nosniff"),
    ("Vary", "Accept-Encoding"),
];

/// Options of `serve`.
#[derive(Debug, Args)]
pub(super) struct ServeOptions {
    /// The folder of the page; without it `page` beside the program, or the one that was installed with it
    folder: Option<PathBuf>,
    /// The port to listen at
    #[arg(long, value_name = "N", default_value_t = 8471)]
    port: u16,
    /// The address to listen at: as it stands this computer alone is answered, with 0.0.0.0 every one that reaches it
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    address: IpAddr,
}

/// Serves until it is stopped.
pub(super) fn run(options: &ServeOptions) -> CommandResult {
    let folder = folder(options.folder.as_deref())?;
    let server = Server::http(SocketAddr::new(options.address, options.port)).map_err(|e| {
        Failure::new(format!("cannot listen at {}, port {}: {e}", options.address, options.port))
            .try_this("another port (--port 8080), or none in particular (--port 0)")
    })?;
    announce(&server, options.address);
    for request in server.incoming_requests() {
        // Whoever hangs up in the middle wants nothing any more.
        let _ = answer(request, &folder);
    }
    Ok(Vec::new())
}

fn announce(server: &Server, address: IpAddr) {
    let port = server.server_addr().to_ip().map_or(0, |place| place.port());
    // This computer's own name is safe to a browser, its number in the network is not.
    let host = match address {
        address if address.is_loopback() || address.is_unspecified() => "localhost".to_owned(),
        IpAddr::V4(address) => address.to_string(),
        IpAddr::V6(address) => format!("[{address}]"),
    };
    let mut told = format!("Sindyscope is at http://{host}:{port}/ until you press Ctrl+C\n");
    if !address.is_loopback() {
        told.push_str(
            "Browsers of other computers let it compute in the background by https only: without, their page stands still while it searches\n",
        );
    }
    // Standard output may be closed; the page is served all the same.
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(told.as_bytes()).and_then(|()| out.flush());
}

/// The folder that is served.
fn folder(named: Option<&Path>) -> Result<PathBuf, Stop> {
    let places = match named {
        Some(folder) => vec![folder.to_owned()],
        None => {
            let program = std::env::current_exe().unwrap_or_default();
            let beside = program.parent().unwrap_or(Path::new(".")).to_owned();
            vec![beside.join("page"), beside.join("../share/sindyscope/page")]
        }
    };
    let found = places.iter().find(|folder| folder.join(PROGRAM).is_file()).and_then(|f| f.canonicalize().ok());
    found.ok_or_else(|| {
        let looked = places.iter().map(|f| f.display().to_string()).collect::<Vec<_>>().join(" nor in ");
        let reason = format!("the web page is not in {looked}: there is no {PROGRAM}");
        Failure::new(reason)
            .try_this(
                "build it with `.ci/web` in Sindyscope's sources, and name its folder: `sindyscope serve target/page`",
            )
            .into()
    })
}

fn answer(request: Request, folder: &Path) -> std::io::Result<()> {
    if !matches!(request.method(), Method::Get | Method::Head) {
        return request.respond(Response::from_string("only reading").with_status_code(405));
    }
    let Some(path) = path(request.url(), folder).filter(|path| path.is_file()) else {
        return request.respond(Response::from_string("there is no such file here").with_status_code(404));
    };
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let kind = KINDS.iter().find(|(of, _)| *of == ending).map_or("application/octet-stream", |(_, kind)| kind);
    let packed = packed(&path).filter(|packed| takes_gzip(&request) && packed.is_file());
    let file = File::open(packed.as_ref().unwrap_or(&path))?;
    let state = state(&file)?;
    let encoding = packed.is_some().then_some(("Content-Encoding", "gzip"));
    let headers = HEADERS.into_iter().chain([("Content-Type", kind), ("ETag", &state)]).chain(encoding);
    let headers: Vec<Header> = headers.filter_map(|(name, value)| Header::from_bytes(name, value).ok()).collect();
    if header(&request, "If-None-Match").is_some_and(|known| known.contains(&state)) {
        let unchanged = headers.into_iter().fold(Response::empty(304), Response::with_header);
        return request.respond(unchanged);
    }
    request.respond(headers.into_iter().fold(Response::from_file(file), Response::with_header))
}

/// What tells a state of a file from any other, as a browser gives it back: length and time of the last change.
fn state(file: &File) -> std::io::Result<String> {
    let about = file.metadata()?;
    let changed = about.modified()?.duration_since(UNIX_EPOCH).unwrap_or_default();
    Ok(format!("\"{:x}-{:x}\"", about.len(), changed.as_nanos()))
}

fn header<'a>(request: &'a Request, name: &'static str) -> Option<&'a str> {
    Some(request.headers().iter().find(|header| header.field.equiv(name))?.value.as_str())
}

/// The same file packed, if it lies beside.
fn packed(path: &Path) -> Option<PathBuf> {
    Some(path.with_file_name(format!("{}.gz", path.file_name()?.to_str()?)))
}

fn takes_gzip(request: &Request) -> bool {
    header(request, "Accept-Encoding").is_some_and(|accepted| accepted.split([',', ' ', ';']).any(|one| one == "gzip"))
}

/// The file that an address means; none if it would lead out of the folder. The page's files have plain names: nothing in
/// an address is decoded.
fn path(url: &str, folder: &Path) -> Option<PathBuf> {
    let named = url.split(['?', '#']).next()?.strip_prefix('/')?;
    let inside = Path::new(if named.is_empty() { "index.html" } else { named });
    let plain = inside.components().all(|part| matches!(part, Component::Normal(_))) && !named.contains('\\');
    // A link may lead out too.
    let path = folder.join(inside).canonicalize().ok().filter(|_| plain)?;
    path.starts_with(folder).then_some(path)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::{Read as _, Write as _};
    use std::net::TcpStream;
    use std::sync::Arc;

    use super::*;

    /// A folder with a page beside a file that is nobody's business.
    fn home() -> tempfile::TempDir {
        let home = tempfile::tempdir().unwrap();
        let web = home.path().join("web");
        fs::create_dir(&web).unwrap();
        for (name, text) in [("index.html", "page"), (PROGRAM, "program"), ("sindyscope_bg.wasm.gz", "packed")] {
            fs::write(web.join(name), text).unwrap();
        }
        fs::write(home.path().join("secret"), "secret").unwrap();
        home
    }

    /// What a server of that folder answers to a request.
    fn answered(folder: &Path, request: &str) -> String {
        let server = Arc::new(Server::http("127.0.0.1:0").unwrap());
        let serving = Arc::clone(&server);
        let folder = folder.to_owned();
        let thread = std::thread::spawn(move || answer(serving.recv().unwrap(), &folder).unwrap());
        let mut stream = TcpStream::connect(server.server_addr().to_ip().unwrap()).unwrap();
        stream.write_all(format!("{request}\r\nHost: localhost\r\nConnection: close\r\n\r\n").as_bytes()).unwrap();
        thread.join().unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        text
    }

    #[test]
    fn the_page_comes_isolated_and_packed_where_that_is_understood() {
        let home = home();
        let web = folder(Some(&home.path().join("web"))).unwrap();
        let page = answered(&web, "GET /?room=2 HTTP/1.1");
        assert!(page.starts_with("HTTP/1.1 200") && page.ends_with("page"), "{page}");
        assert!(page.contains("Cross-Origin-Opener-Policy: same-origin"), "{page}");
        assert!(page.contains("Content-Type: text/html"), "{page}");
        let program = answered(&web, "GET /sindyscope_bg.wasm HTTP/1.1");
        assert!(program.ends_with("program") && program.contains("application/wasm"), "{program}");
        let packed = answered(&web, "GET /sindyscope_bg.wasm HTTP/1.1\r\nAccept-Encoding: br, gzip;q=0.8");
        assert!(packed.ends_with("packed") && packed.contains("Content-Encoding: gzip"), "{packed}");
        assert!(packed.contains("application/wasm"), "{packed}");
        let state = page.lines().find_map(|line| line.strip_prefix("ETag: ")).unwrap();
        let again = answered(&web, &format!("GET / HTTP/1.1\r\nIf-None-Match: {state}"));
        assert!(again.starts_with("HTTP/1.1 304") && !again.ends_with("page"), "{again}");
    }

    #[test]
    fn nothing_beside_the_folder_is_handed_out() {
        let home = home();
        let web = folder(Some(&home.path().join("web"))).unwrap();
        for way in ["/../secret", "/%2e%2e/secret", "//secret", "/..\\secret", "secret", "/none", "/."] {
            let told = answered(&web, &format!("GET {way} HTTP/1.1"));
            assert!(!told.contains("HTTP/1.1 200") && !told.ends_with("secret"), "{way}: {told}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(home.path().join("secret"), web.join("link")).unwrap();
            assert!(answered(&web, "GET /link HTTP/1.1").starts_with("HTTP/1.1 404"));
        }
        assert!(answered(&web, "POST / HTTP/1.1\r\nContent-Length: 0").starts_with("HTTP/1.1 405"));
    }

    #[test]
    fn a_folder_without_the_page_says_how_it_is_built() {
        let home = tempfile::tempdir().unwrap();
        let Err(Stop::Failure(failure)) = folder(Some(home.path())) else { panic!("there is no page") };
        let told = failure.to_string();
        assert!(told.contains(PROGRAM) && told.contains(".ci/web"), "{told}");
    }
}
