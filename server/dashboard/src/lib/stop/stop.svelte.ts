/** Stop, for the whole page: `stop.press()` from anywhere, `stop.state` tells what became of it. */

import { api, ask, here } from '../api/client';
import { isStopKey, StopCall, type StopState } from './stop';

class Stop {
  state = $state.raw<StopState>({ kind: 'none' });
  private call: StopCall | null = null;

  /** At once, and without a question. */
  press(): void {
    this.call?.leave();
    this.call = new StopCall({
      send: () => ask(api.POST('/api/v1/robots/{robot}/stop', { params: { path: here() } })),
      after: (seconds, call) => {
        const timer = setTimeout(call, seconds * 1000);
        return () => clearTimeout(timer);
      },
      told: (state) => {
        this.state = state;
      },
    });
    this.call.begin();
  }

  /** The message has been read. */
  dismiss(): void {
    this.call?.leave();
    this.state = { kind: 'none' };
  }

  /** Listens for the keys before anything else on the page does. */
  start(): void {
    addEventListener(
      'keydown',
      (event) => {
        if (!isStopKey(event)) return;
        event.preventDefault();
        event.stopImmediatePropagation();
        if (!event.repeat) this.press();
      },
      { capture: true },
    );
  }
}

export const stop = new Stop();
