"""What a notebook shows of an animation."""

from nested_agents.studies.api.replay import Replay


def test_a_title_is_text_in_html(tmp_path) -> None:
    path = tmp_path / "a<b.gif"
    path.write_bytes(b"GIF89a")
    html = Replay(path, "it's <script>alert(1)</script> & more")._repr_html_()
    assert html.startswith("<img alt='it&#x27;s &lt;script&gt;alert(1)&lt;/script&gt; &amp; more' ")
    film = path.with_suffix(".mp4")
    film.write_bytes(b"")
    named = Replay(film, "<b>")._repr_html_()
    assert named == f"&lt;b&gt;: {str(film).replace('<', '&lt;')}"
