/** Stop, for the whole page: `stop.press()` from anywhere, `stop.words` tells what became of it, and if it still holds. */

import { api, ask, here, isFleet } from '../api/client';
import { currentToken } from '../api/token';
import type { StopResult } from '../api/types';
import { timeOfDay } from '../format';
import { type ArmNow, type Standing, StopStanding } from './standing';
import { isStopKey, StopCall, type StopState } from './stop';
import { wordsOf } from './words';

/** Where this tab keeps when Stop was pressed last, ms since 1970. */
const PRESSED = 'stop-pressed';
/** ms between a press on this page and the stop that the service tells of. */
const SAME_PRESS = 5000;

class Stop {
  state = $state.raw<StopState>({ kind: 'none' });
  private standing = $state<Standing>('holds');
  private arm = $state<ArmNow>('unknown');
  /** Time of day at which `state` was told. */
  private time = $state('');
  words = $derived(wordsOf(this.state, this.standing, this.arm, this.time));
  /** Whether the stop was reset on this page, and the queue, which it paused, may still have to be resumed. */
  isReset = $state(false);
  /** The port of the listener that takes stops alone; null until the service has told it. */
  port: number | null = null;
  /** The last press. */
  call: StopCall | null = null;
  /** The robot that the last press was for; empty for all. */
  target = '';
  private followed = new StopStanding('none');

  get isOfAll(): boolean {
    return this.target === '';
  }

  /** At once, and without a question: for all arms of the service, unless one is named. */
  press(robot = isFleet() ? '' : here().robot): void {
    this.call?.leave();
    this.isReset = false;
    this.target = robot;
    const address = robot === '' ? '/fleet/stop' : `/robots/${encodeURIComponent(robot)}/stop`;
    const service = (): Promise<StopResult> => sendToService(robot);
    const listener = (): Promise<StopResult> => sendToListener(this.port ?? 0, address);
    this.call = new StopCall({
      doors: this.port === null ? [service] : [service, listener],
      after: (seconds, call) => {
        const timer = setTimeout(call, seconds * 1000);
        return () => clearTimeout(timer);
      },
      told: (state) => this.tell(isFleet() && robot !== '' ? named(robot, state) : state),
    });
    this.call.begin();
    sessionStorage.setItem(PRESSED, String(Date.now())); // after the stop is on its way: storage may refuse
    // After the stop is on its way: a thumb feels that it was pressed. What became of it is said, not felt.
    if ('vibrate' in navigator) navigator.vibrate(80);
  }

  /** Whether a stop that the service has told of at that time is the last press on this page, also before it was loaded
   * anew. */
  wasPressedAt(at: string): boolean {
    return Math.abs(Date.parse(at) - Number(sessionStorage.getItem(PRESSED))) < SAME_PRESS;
  }

  /** The message about this press has been read, or a reset has ended it. A newer one is left as it is. */
  dismiss(call = this.call): void {
    if (call !== this.call) return;
    call?.leave();
    this.tell({ kind: 'none' });
  }

  /** What is known of the arm at `at` (s): a message that no longer holds is not left standing. */
  heard(arm: ArmNow, at: number): void {
    this.arm = arm;
    this.standing = this.followed.heard(arm, at);
  }

  private tell(state: StopState): void {
    this.state = state;
    if (state.kind === this.followed.kind) return;
    this.followed = new StopStanding(state.kind);
    this.standing = 'holds';
    this.time = timeOfDay(new Date().toISOString());
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

/** The same, saying which of several arms it is about. */
function named(robot: string, state: StopState): StopState {
  return 'text' in state ? { ...state, text: `${robot}: ${state.text}` } : state;
}

function sendToService(robot: string): Promise<StopResult> {
  if (robot === '') return ask(api.POST('/api/v1/fleet/stop'));
  return ask(api.POST('/api/v1/robots/{robot}/stop', { params: { path: { robot } } }));
}

async function sendToListener(port: number, path: string): Promise<StopResult> {
  const token = currentToken();
  const headers: HeadersInit = token === null ? {} : { Authorization: `Bearer ${token}` };
  const address = `${location.protocol}//${location.hostname}:${port}/api/v1${path}`;
  const answer = await fetch(address, { method: 'POST', headers });
  if (!answer.ok) throw new Error(`the stop listener answered ${answer.status}`);
  return (await answer.json()) as StopResult;
}

export const stop = new Stop();
