/**
 * How much drawing this computer can take. Everything is drawn sparingly until a graphics card is known: to ask takes
 * time, and is not done before the first data is on the screen.
 */

import { askedName, rendererOf, type Renderer } from './renderer';

class Rendering {
  renderer = $state<Renderer | 'unknown'>('unknown');
  /** Whether lines are thin, and 3-D has the time that is left over. */
  isSpared: boolean = $derived(this.renderer !== 'card');

  /** Asks what draws, once. */
  look(): Renderer {
    if (this.renderer === 'unknown') this.renderer = rendererOf(askedName());
    return this.renderer;
  }
}

export const rendering = new Rendering();
