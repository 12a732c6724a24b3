"""The viewer in the browser: what was asked (session), what is shown (scene, panel), and the server (viewer)."""
