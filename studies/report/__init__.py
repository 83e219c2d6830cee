"""The report of a study: one HTML file that holds everything and asks the network for nothing.

`page` gathers what the template ``page.html.jinja`` shows; `words` puts it in sentences, `tables`
in rows, `pictures` are the study's own figures, `replays` its recorded episodes, packed for the
canvas that the scenario's player draws. Whatever the study, its `analyse`, `notes` and `draw` are
all that is asked of it. Equal results, written by equal software, give equal bytes.
"""
