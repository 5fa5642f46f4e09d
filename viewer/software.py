"""Browsers without a GPU: found out, and spared work while frames play.

viser has no call for the resolution of its canvas, but its page has a setting for developers; the message that sets it
is viser's own, for scripts. Where a later viser lacks either, nothing is found out and nothing is spared.
"""

import viser

_FIND_OUT = """
const context = document.createElement('canvas').getContext('webgl2');
const about = context && context.getExtension('WEBGL_debug_renderer_info');
const name = about ? context.getParameter(about.UNMASKED_RENDERER_WEBGL) : '';
const soft = /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
localStorage.setItem('viser-user:depthsim-renderer', soft ? 'software' : 'hardware');
"""
_SHARPNESS = """
const settings = window.__viserTestpoints && window.__viserTestpoints.devSettings;
if (settings && !new URLSearchParams(location.search).has('fixedDpr')) settings.set({fixedDpr: %s});
"""
COARSE = 0.4
"""Pixels of the 3D view per pixel of the screen, each way, while frames play by software."""


def draws_by_software(client: viser.ClientHandle) -> bool:
    """Whether this browser has no GPU; waits for its answer."""
    if not _run(client, _FIND_OUT):
        return False
    try:
        return client.local_storage.get_item("depthsim-renderer", timeout=20) == "software"
    except (RuntimeError, TimeoutError):
        return False


def set_sharpness(client: viser.ClientHandle, pixels: float | None) -> None:
    """Pixels of the 3D view per pixel of the screen; None leaves it to the page."""
    _run(client, _SHARPNESS % ("null" if pixels is None else pixels))


def _run(client: viser.ClientHandle, script: str) -> bool:
    try:
        from viser._messages import RunJavascriptMessage

        client.gui._websock_interface.queue_message(RunJavascriptMessage(source="{" + script + "}"))
    except (ImportError, AttributeError):
        return False
    return True
