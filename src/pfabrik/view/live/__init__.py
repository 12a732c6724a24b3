"""The viewer in the browser: target and answer (session), the page (scene, panel), and the server (viewer)."""
