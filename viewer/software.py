"""Browsers without a GPU: found out by a script, and kept from drawing a picture more than once.

Whatever comes, viser's page draws its 3D view for a quarter of a second on end, in case something is not ready yet. By
software that is most of what a frame costs. The message for scripts, and what they take hold of, are viser's own: where
a later viser lacks one, nothing is found out, or nothing is spared.
"""

import viser

_FIND_OUT = """
const context = document.createElement('canvas').getContext('webgl2');
const about = context && context.getExtension('WEBGL_debug_renderer_info');
const name = about ? context.getParameter(about.UNMASKED_RENDERER_WEBGL) : '';
const soft = /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
localStorage.setItem('viser-user:depthsim-renderer', soft ? 'software' : 'hardware');
"""
_DRAW_ONCE = """
const page = window.__viserMutable, view = page && page.scene && page.scene.__r3f && page.scene.__r3f.root;
if (view && page.drainMessageQueue && page.backgroundMaterial && !page.drawOften) {
  page.drawOften = page.requestRender;
  const shown = page.backgroundMaterial.uniforms.colorMap;
  let awaited = null, later = 0;
  const draw = () => { awaited = null; clearTimeout(later); view.getState().invalidate(); };
  page.requestRender = () => {
    if (awaited) {  // what came after a picture, the question for an echo too, waits until that is decoded and drawn
      if (shown.value !== awaited.before) draw();
    } else if (!page.messageQueue.length || page.getRenderRequestState !== 'ready') {
      draw();
    } else {
      if (page.messageQueue.some(one => one.type === 'BackgroundImageMessage')) awaited = {before: shown.value};
      page.drainMessageQueue();
      clearTimeout(later);
      later = setTimeout(draw, 250);
    }
  };
}
"""
_DRAW_OFTEN = """
const page = window.__viserMutable;
if (page && page.drawOften) { page.requestRender = page.drawOften; delete page.drawOften; page.requestRender(); }
"""


def draws_by_software(client: viser.ClientHandle) -> bool:
    """Whether this browser has no GPU; waits for its answer."""
    if not _run(client, _FIND_OUT):
        return False
    try:
        return client.local_storage.get_item("depthsim-renderer", timeout=20) == "software"
    except (RuntimeError, TimeoutError):
        return False


def draw_once(client: viser.ClientHandle, once: bool) -> None:
    """Have the page draw its 3D view once for each picture that comes, or as viser has it."""
    _run(client, _DRAW_ONCE if once else _DRAW_OFTEN)


def _run(client: viser.ClientHandle, script: str) -> bool:
    try:
        from viser._messages import RunJavascriptMessage

        client.gui._websock_interface.queue_message(RunJavascriptMessage(source="{" + script + "}"))
    except (ImportError, AttributeError):
        return False
    return True
