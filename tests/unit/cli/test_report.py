"""``stokesfibers report`` from the command line."""

from __future__ import annotations


def test_the_report_is_written_beside_the_run(run, invoke):
    result = invoke("report", run, "--title", "A <b> title")
    assert result.exit_code == 0, result.stderr
    page = run.with_suffix(".html")
    assert result.stdout.strip() == str(page)
    text = page.read_text()
    assert "<title>A &lt;b&gt; title</title>" in text
    assert "slenderness = 0.01" in text


def test_bad_names_are_refused(run, invoke):
    for name in ("a.pdf", "no/a.html"):
        result = invoke("report", run, "--out", run.parent / name)
        assert result.exit_code == 2
        assert "--out: expected a file" in result.stderr
    assert invoke("report", run.with_name("none.zarr")).exit_code == 2
