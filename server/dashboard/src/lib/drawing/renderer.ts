/** What draws for this browser: a graphics card, or the processor in its place. */

export type Renderer = 'card' | 'processor' | 'none';

/** Names under which processors draw 3-D. */
const PROCESSORS = /swiftshader|llvmpipe|softpipe|software|basic render|swrast/i;

/** What WebGL says that it is drawn by. `name`: null where there is no WebGL. */
export function rendererOf(name: string | null): Renderer {
  if (name === null) return 'none';
  return PROCESSORS.test(name) ? 'processor' : 'card';
}

/** The name of what draws, asked for once of a picture that is thrown away; null without WebGL. */
export function askedName(): string | null {
  const context = document.createElement('canvas').getContext('webgl2', { powerPreference: 'low-power' });
  if (context === null) return null;
  const details = context.getExtension('WEBGL_debug_renderer_info');
  const name = context.getParameter(details?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER) as unknown;
  context.getExtension('WEBGL_lose_context')?.loseContext();
  return String(name);
}
