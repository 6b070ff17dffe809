"""What a running gateway shows: status block, lines, live view, metrics, web page."""
