"""Fetching recordings from a server of our own: what arrives, what is asked of it, and what can go wrong."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import socket
import subprocess
import threading
from collections.abc import Iterator
from email.utils import parsedate_to_datetime
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

import sixpoint as sp
from sixpoint.cli import app as program
from sixpoint.cli import main
from sixpoint.cli.data import data as data_command
from sixpoint.datasets import cmu, download
from sixpoint.datasets.checksums import read_sums
from sixpoint.errors import SixpointError
from sixpoint.jobs.data import Outcome, fetch_cmu

ASF = b"# AST/ASF file generated using VICON BodyLanguage\r\n:version 1.10\r\n"
AMC = b"#!OML:ASF F:\\VICON\\rory3.ASF\n:FULLY-SPECIFIED\n:DEGREES\n" + b"".join(
    b"%d\nroot 0.3703 16.4004 -14.3706 30.6706 -5.23012 -3.94429\n" % frame for frame in range(1, 4000)
)
MOTION, SKELETON = "/subjects/17/17_10.amc", "/subjects/17/17.asf"
OLD, NEW = "Tue, 24 Nov 2009 20:01:02 GMT", "Wed, 25 Nov 2009 20:01:02 GMT"


class Site:
    """A small copy of the database, and how it misbehaves.

    Attributes:
        pages: Path -> content.
        asked: Path and range of every request.
        cut: Path -> after how many bytes the connection is closed.
        ranges: Whether parts of files are served.
        lengths: Whether answers tell their length.
        date: Last-Modified of all files.
    """

    def __init__(self) -> None:
        self.pages = {MOTION: AMC, SKELETON: ASF}
        self.asked: list[tuple[str, str | None]] = []
        self.cut: dict[str, int] = {}
        self.ranges = True
        self.lengths = True
        self.date = OLD
        self.url = ""

    def answer(self, request: BaseHTTPRequestHandler) -> None:
        """Serve one request."""
        asked = request.headers.get("Range")
        self.asked.append((request.path, asked))
        page = self.pages.get(request.path)
        if page is None:
            return request.send_error(404)
        begin = 0
        if asked and self.ranges and request.headers.get("If-Range", self.date) == self.date:
            begin = int(asked.removeprefix("bytes=").removesuffix("-"))
            if begin >= len(page):
                return request.send_error(416)
        request.send_response(206 if begin else 200)
        if begin:
            request.send_header("Content-Range", f"bytes {begin}-{len(page) - 1}/{len(page)}")
        if self.lengths:
            request.send_header("Content-Length", str(len(page) - begin))
        request.send_header("Last-Modified", self.date)
        request.end_headers()
        request.wfile.write(page[begin : self.cut.get(request.path, len(page))])


@pytest.fixture
def site(monkeypatch: pytest.MonkeyPatch) -> Iterator[Site]:
    """A server on this computer; no test reaches beyond it."""
    monkeypatch.setenv("no_proxy", "*")
    made = Site()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            made.answer(self)

        def log_message(self, *_: object) -> None: ...

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        made.url = f"http://127.0.0.1:{server.server_port}"
        yield made
        server.shutdown()


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """Run a command line: exit code, stdout and stderr."""
    make_app = program.make_app

    def with_data():
        app = make_app()
        if "data" not in app:
            app.command(data_command)
        return app

    def run_words(*words: str) -> tuple[int, str, str]:
        capsys.readouterr()
        code = main(words)
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return code, out, err

    monkeypatch.setattr(program, "make_app", with_data)
    return run_words


def fails(site: Site, out: Path, *trials: str, force: bool = False) -> str:
    """The message of a fetch that must fail."""
    with pytest.raises(SixpointError) as caught:
        fetch_cmu(trials or ("17_10",), out, site=site.url, force=force)
    return str(caught.value)


def sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def test_a_trial_arrives_with_its_skeleton_hashes_and_credit(site, tmp_path):
    """A fetch leaves the two files as the server has them, their hashes, the credit, and nothing else."""
    done = fetch_cmu(["17_10"], tmp_path, site=site.url)
    assert set(done.files.values()) == {Outcome.FETCHED}
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {
        "17.asf": ASF,
        "17_10.amc": AMC,
        "SHA256SUMS": f"{sha256(ASF)}  17.asf\n{sha256(AMC)}  17_10.amc\n".encode(),
        "CREDIT.txt": (
            b"The data used in this project was obtained from mocap.cs.cmu.edu. "
            b"The database was created with funding from NSF EIA-0196217.\n"
        ),
    }


def test_a_second_run_asks_nothing(site, tmp_path):
    """Files that are here with their recorded hash are not fetched again."""
    fetch_cmu(["17_10"], tmp_path, site=site.url)
    assert site.asked == [(SKELETON, None), (MOTION, None)]
    done = fetch_cmu(["17_10"], tmp_path, site=site.url)
    assert len(site.asked) == 2
    assert set(done.files.values()) == {Outcome.KEPT}


def test_trials_of_a_subject_share_its_skeleton(site, tmp_path):
    """Each file is fetched once, however often it is needed."""
    site.pages["/subjects/17/17_02.amc"] = AMC
    fetch_cmu(["17_10", "17_02.amc", "17_10"], tmp_path, site=site.url + "/")
    assert [path for path, _ in site.asked] == [SKELETON, MOTION, "/subjects/17/17_02.amc"]


@pytest.mark.skipif(shutil.which("sha256sum") is None, reason="no sha256sum here")
def test_sha256sum_checks_the_folder(site, tmp_path):
    """The record is in the format of sha256sum."""
    fetch_cmu(["17_10"], tmp_path, site=site.url)
    checked = subprocess.run(["sha256sum", "-c", "SHA256SUMS"], cwd=tmp_path, capture_output=True, text=True)
    assert (checked.returncode, checked.stdout.count("OK")) == (0, 2)


def test_a_recording_that_was_fetched_is_found_with_its_skeleton(site, tmp_path):
    """Motion and skeleton lie side by side, so that the motion can be loaded."""
    sp.save(sp.make_sample("walk").sliced(slice(0, 5)), tmp_path / "x.amc")
    site.pages = {MOTION: (tmp_path / "x.amc").read_bytes(), SKELETON: (tmp_path / "x.asf").read_bytes()}
    fetch_cmu(["17_10"], tmp_path, site=site.url)
    assert len(sp.load(tmp_path / "17_10.amc")) == 5


def test_a_cut_transfer_goes_on(site, tmp_path):
    """After a cut the beginning stays under another name, and only the rest is asked for."""
    site.cut[MOTION] = 100_000
    message = fails(site, tmp_path)
    assert f"17_10.amc: the transfer ended after 100000 of {len(AMC)} bytes; run again" in message
    assert (tmp_path / "17_10.amc.part").read_bytes() == AMC[:100_000]
    assert not (tmp_path / "17_10.amc").exists()
    site.cut.clear()
    fetch_cmu(["17_10"], tmp_path, site=site.url)
    assert site.asked[2:] == [(MOTION, "bytes=100000-")]
    assert (tmp_path / "17_10.amc").read_bytes() == AMC
    assert not list(tmp_path.glob("*.part"))


def test_a_transfer_cut_twice_goes_on(site, tmp_path):
    """The rest of a file can be cut as well."""
    for end in (70_000, 150_000):
        site.cut[MOTION] = end
        assert f"after {end} of {len(AMC)} bytes" in fails(site, tmp_path)
    site.cut.clear()
    fetch_cmu(["17_10"], tmp_path, site=site.url)
    assert [asked for _, asked in site.asked] == [None, None, "bytes=70000-", "bytes=150000-"]
    assert (tmp_path / "17_10.amc").read_bytes() == AMC


def test_a_server_without_ranges_sends_all_again(site, tmp_path):
    """Where the rest cannot be had alone, the transfer starts again."""
    site.ranges = False
    site.cut[MOTION] = 100_000
    fails(site, tmp_path)
    site.cut.clear()
    fetch_cmu(["17_10"], tmp_path, site=site.url)
    assert site.asked[-1] == (MOTION, "bytes=100000-")
    assert (tmp_path / "17_10.amc").read_bytes() == AMC


def test_two_versions_are_never_joined(site, tmp_path):
    """A file that changed on the server after a cut is fetched from its beginning."""
    site.cut[MOTION] = 100_000
    fails(site, tmp_path)
    site.cut.clear()
    site.pages[MOTION], site.date = AMC.replace(b"root 0", b"root 1"), NEW
    fetch_cmu(["17_10"], tmp_path, site=site.url)
    assert (tmp_path / "17_10.amc").read_bytes() == site.pages[MOTION]


@pytest.mark.parametrize("surplus", [b"", b"more"])
def test_a_beginning_that_lacks_nothing_is_fetched_again(site, tmp_path, surplus):
    """What was whole but never got its name, or is too long, does not get stuck."""
    part = tmp_path / "17_10.amc.part"
    part.write_bytes(AMC + surplus)
    date = parsedate_to_datetime(OLD).timestamp()
    os.utime(part, (date, date))
    fetch_cmu(["17_10"], tmp_path, site=site.url)
    assert site.asked[1:] == [(MOTION, f"bytes={len(AMC + surplus)}-"), (MOTION, None)]
    assert (tmp_path / "17_10.amc").read_bytes() == AMC


def test_another_range_than_asked_for_is_refused(site, tmp_path):
    """A server that sends another part is not believed, and the next run starts again."""
    answer = site.answer

    def shifted(request):
        send = request.send_header
        request.send_header = lambda key, value: send(key, value.replace("bytes 1", "bytes 2"))
        answer(request)

    site.cut[MOTION] = 100_000
    fails(site, tmp_path)
    site.cut.clear()
    site.answer = shifted
    assert "another part than asked for" in fails(site, tmp_path)
    fetch_cmu(["17_10"], tmp_path, site=site.url)
    assert (tmp_path / "17_10.amc").read_bytes() == AMC


def test_a_server_need_not_tell_the_length(site, tmp_path):
    """Without Content-Length the file arrives, and progress is told without a total."""
    site.lengths = False
    told = []
    fetch_cmu(["17_10"], tmp_path, site=site.url, progress=lambda *args: told.append(args))
    assert (tmp_path / "17_10.amc").read_bytes() == AMC
    assert ("kB of this file", len(AMC) // 1000, len(AMC) // 1000) in told


def test_progress_is_told_in_files_and_kilobytes(site, tmp_path):
    """Progress never exceeds its total, and ends at it."""
    told = []
    fetch_cmu(["17_10"], tmp_path, site=site.url, progress=lambda *args: told.append(args))
    assert all(0 <= done <= total for _, done, total in told)
    assert told[0] == ("files", 0, 2)
    assert told[-1] == ("files", 2, 2)
    assert ("kB of this file", len(AMC) // 1000, len(AMC) // 1000) in told


def test_no_such_trial(site, tmp_path):
    """A 404 names the trial and its address, and says where trials are listed."""
    message = fails(site, tmp_path, "17_99")
    assert f"17_99.amc: {site.url}/subjects/17/17_99.amc: not on the server (404)" in message
    assert "listed at http://mocap.cs.cmu.edu" in message
    assert (tmp_path / "17.asf").exists()


def test_other_refusals_give_the_status(site, tmp_path):
    """A server in trouble is quoted."""
    site.answer = lambda request: request.send_error(503)
    assert "the server answers 503 Service Unavailable" in fails(site, tmp_path)


@pytest.mark.parametrize(
    ("page", "said"),
    [
        (b"\n<!DOCTYPE html><html>Log in</html>", "a web page"),
        (b"", "an empty file"),
        (b"HIERARCHY\nROOT hip\n", "'HIERARCHY'"),
        (b"\x1f\x8b\x08\x00\x00", r"'\x1f\x8b"),
    ],
)
def test_something_else_than_a_recording_is_refused(site, tmp_path, page, said):
    """A page in place of the file is an error in one line and leaves nothing behind."""
    site.pages[MOTION] = page
    message = fails(site, tmp_path)
    assert f"{MOTION}: not a recording but {said}" in message
    assert not list(tmp_path.glob("17_10*"))
    assert list(read_sums(tmp_path / "SHA256SUMS")) == ["17.asf"]


def test_a_file_changed_on_the_server_is_an_error(site, tmp_path):
    """A study is repeated with the recorded files or not at all; --force takes the new ones."""
    fetch_cmu(["17_10"], tmp_path, site=site.url)
    (tmp_path / "17_10.amc").unlink()
    site.pages[MOTION] = other = AMC + b"4000\nroot 0 0 0 0 0 0\n"
    message = fails(site, tmp_path)
    for words in (MOTION, "not the file that was recorded", sha256(AMC), sha256(other), "--force"):
        assert words in message
    assert sorted(path.name for path in tmp_path.iterdir()) == ["17.asf", "CREDIT.txt", "SHA256SUMS"]
    fetch_cmu(["17_10"], tmp_path, site=site.url, force=True)
    assert (tmp_path / "17_10.amc").read_bytes() == other
    assert read_sums(tmp_path / "SHA256SUMS") == {"17.asf": sha256(ASF), "17_10.amc": sha256(other)}


def test_a_file_changed_here_is_an_error(site, tmp_path):
    """An edited file is neither used nor lost; --force fetches it anew."""
    fetch_cmu(["17_10"], tmp_path, site=site.url)
    path = tmp_path / "17_10.amc"
    path.write_bytes(b":mine")
    message = fails(site, tmp_path)
    for words in (str(path), "changed since it was recorded", sha256(AMC), sha256(b":mine"), "--force"):
        assert words in message
    assert path.read_bytes() == b":mine"
    assert len(site.asked) == 2
    fetch_cmu(["17_10"], tmp_path, site=site.url, force=True)
    assert path.read_bytes() == AMC


def test_force_loses_nothing_when_it_fails(site, tmp_path):
    """A file stays until its successor has arrived."""
    fetch_cmu(["17_10"], tmp_path, site=site.url)
    before = (tmp_path / "SHA256SUMS").read_bytes()
    site.cut[MOTION] = 10
    fails(site, tmp_path, force=True)
    assert (tmp_path / "17_10.amc").read_bytes() == AMC
    assert sorted((tmp_path / "SHA256SUMS").read_bytes().splitlines()) == sorted(before.splitlines())


def test_files_of_the_user_are_kept_and_recorded(site, tmp_path):
    """A recording that was here before is used as it is; anything else by its name is an error."""
    path = tmp_path / "17_10.amc"
    path.write_bytes(b"\xef\xbb\xbf# mine\n:DEGREES\n")
    done = fetch_cmu(["17_10"], tmp_path, site=site.url)
    assert done.files == {tmp_path / "17.asf": Outcome.FETCHED, path: Outcome.ADOPTED}
    assert read_sums(tmp_path / "SHA256SUMS")["17_10.amc"] == sha256(path.read_bytes())
    assert fetch_cmu(["17_10"], tmp_path, site=site.url).files[path] is Outcome.KEPT
    (tmp_path / "17_11.amc").write_bytes(b"<html>")
    assert "not a recording but a web page" in fails(site, tmp_path, "17_11")
    assert (tmp_path / "17_11.amc").read_bytes() == b"<html>"


def test_what_users_write_into_record_and_credit_stays(site, tmp_path):
    """Comments, entries of other files and words of thanks are kept."""
    entry = f"# ours\n{'A' * 64} *take.c3d\n"
    (tmp_path / "SHA256SUMS").write_text(entry)
    (tmp_path / "CREDIT.txt").write_text("Thanks to Rory.")
    fetch_cmu(["17_10"], tmp_path, site=site.url)
    assert (tmp_path / "SHA256SUMS").read_text().startswith(entry)
    assert (tmp_path / "CREDIT.txt").read_text() == f"Thanks to Rory.\n{cmu.CREDIT}\n"


@pytest.mark.parametrize("content", [b"17_10.amc is fine\n", b"\xff\xfe"])
def test_a_damaged_record_is_an_error(site, tmp_path, content):
    """A record that cannot be read stops the fetch: hashes would be recorded anew without a word."""
    (tmp_path / "SHA256SUMS").write_bytes(content)
    assert "SHA256SUMS" in fails(site, tmp_path)
    assert not site.asked


def test_the_record_alone_repeats_a_study(site, tmp_path):
    """A record that was given away holds for an empty folder."""
    fetch_cmu(["17_10"], tmp_path / "a", site=site.url)
    (tmp_path / "b").mkdir()
    shutil.copy(tmp_path / "a" / "SHA256SUMS", tmp_path / "b")
    site.pages[SKELETON] += b":name other\n"
    assert "1 of 2 files failed" in fails(site, tmp_path / "b")
    assert (tmp_path / "b" / "17_10.amc").read_bytes() == AMC


def test_nobody_answers(site, tmp_path, monkeypatch):
    """A closed port, an unknown host and a silent server each end in a reason, within the time limit."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        monkeypatch.setattr(download, "TIMEOUT", 0.1)
        site.url = f"http://127.0.0.1:{port}"
        assert "cannot be reached: no answer within 0.1 s; check the network" in fails(site, tmp_path)
    assert "cannot be reached: Connection refused" in fails(site, tmp_path)

    def unknown(*_: object, **__: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    assert "cannot be reached: Name or service not known" in fails(site, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["CREDIT.txt"]


def test_a_server_that_falls_silent_is_left(site, tmp_path, monkeypatch):
    """A transfer that stalls ends within the time limit, and what arrived stays."""
    answer, over = site.answer, threading.Event()

    def stall(request):
        answer(request)
        request.wfile.flush()
        over.wait(10)

    site.cut[MOTION], site.answer = 100_000, stall
    monkeypatch.setattr(download, "TIMEOUT", 0.2)
    message = fails(site, tmp_path)
    over.set()
    assert "the transfer broke off: no answer within 0.2 s; run again" in message
    assert AMC.startswith((tmp_path / "17_10.amc.part").read_bytes())


def test_all_failures_are_listed_and_the_rest_arrives(site, tmp_path):
    """One bad file does not keep the others from being fetched, recorded and kept."""
    site.pages["/subjects/01/01.asf"] = ASF
    site.pages["/subjects/90/90.asf"] = b"<html>"
    message = fails(site, tmp_path, "90_05", "17_10", "01_03")
    assert message.startswith("3 of 6 files failed: 90.asf: ")
    assert " | 90_05.amc: " in message
    assert " | 01_03.amc: " in message
    assert message.endswith(f"the others are in {tmp_path}")
    assert set(read_sums(tmp_path / "SHA256SUMS")) == {"17.asf", "17_10.amc", "01.asf"}


@pytest.mark.parametrize("name", ["17-10", "17", "1_3", "17_10.bvh", "../17_10", "17_10/", "", "١٧_١٠"])
def test_bad_trial_names(site, tmp_path, name):
    """A name that is not a trial's is refused with the form of one, before anything is asked or made."""
    message = fails(site, tmp_path / "new", "17_10", name)
    assert f"not a trial: {name!r}" in message
    assert "17_10" in message
    assert not site.asked
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    "url",
    ["mocap.cs.cmu.edu", "file:///data", "ftp://x", "http://", "http://x:y", "http://ä.de", "http://x/?q"],
)
def test_bad_base_urls(tmp_path, url):
    """A base URL that cannot work is refused with one that can."""
    with pytest.raises(SixpointError, match=re.escape(cmu.SITE)):
        fetch_cmu(["17_10"], tmp_path, site=url)


def test_addresses_of_the_database():
    """Files are where the database has them, and it is the default."""
    assert cmu.list_files(["01_03", "127_29.AMC"]) == ["01.asf", "01_03.amc", "127.asf", "127_29.amc"]
    assert cmu.locate("01_03.amc", cmu.SITE) == "http://mocap.cs.cmu.edu/subjects/01/01_03.amc"
    assert cmu.locate("127.asf", cmu.SITE) == "http://mocap.cs.cmu.edu/subjects/127/127.asf"


def test_folders_that_cannot_be_written(site, tmp_path):
    """A file in place of the folder, or above it, is said before anything is asked."""
    (tmp_path / "file").write_text("x")
    assert "this is a file" in fails(site, tmp_path / "file")
    assert "cannot be made: Not a directory" in fails(site, tmp_path / "file" / "in")
    assert not site.asked


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission(site, tmp_path):
    """A folder that may not be written is said before anything is asked."""
    tmp_path.chmod(0o500)
    assert "Permission denied" in fails(site, tmp_path)
    assert not site.asked


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_full_disk(site, tmp_path):
    """A disk without space is named with the file, and the other files are tried."""
    (tmp_path / "17.asf.part").symlink_to("/dev/full")
    assert "17.asf.part: cannot be written: No space left on device" in fails(site, tmp_path)
    assert (tmp_path / "17_10.amc").exists()


def test_a_folder_in_place_of_a_recording(site, tmp_path):
    """A folder by the name of a recording is an error, also with force."""
    (tmp_path / "17_10.amc").mkdir()
    assert "17_10.amc: cannot be read: Is a directory" in fails(site, tmp_path)
    assert "17_10.amc" in fails(site, tmp_path, force=True)


def test_command_fetches_and_says_where(site, tmp_path, monkeypatch, run):
    """The command says where the files are, to whom credit is due and what comes next."""
    monkeypatch.chdir(tmp_path)
    code, out, err = run("data", "cmu", "17_10.amc", "--from", site.url)
    assert (code, err) == (0, "")
    assert (tmp_path / "data" / "cmu" / "17_10.amc").read_bytes() == AMC
    for words in (
        f"in {Path('data/cmu')}",
        "17.asf",
        cmu.CREDIT,
        f"sixpoint compare {Path('data/cmu/17_10.amc')}",
    ):
        assert words in out
    code, out, _ = run("data", "cmu", "17_10", "--from", site.url)
    assert (code, len(site.asked)) == (0, 2)
    assert out.count("already here") == 2
    assert run("data", "cmu", "17_10", "--from", site.url, "--out", "x", "--force")[0] == 0
    assert (tmp_path / "x" / "17_10.amc").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["17_10", "17_99", "--from", "SITE"], "404"),
        (["17-10", "--from", "SITE"], "subject_trial"),
        (["17_10", "--from", "nowhere"], "base URL"),
        (["--from", "SITE"], "TRIALS"),
    ],
)
def test_command_reports_errors_in_one_line(site, tmp_path, monkeypatch, run, words, said):
    """Whatever goes wrong is one line on stderr and exit code 2."""
    monkeypatch.chdir(tmp_path)
    code, _, err = run("data", "cmu", *(site.url if word == "SITE" else word for word in words))
    assert (code, err.count("\n")) == (2, 1)
    assert said in err
