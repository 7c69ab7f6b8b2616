/** The camera beside the arm: its newest picture and how old that is. The service is asked only while it is shown. */

import { api, ask, here, addressOf, asProblem } from '../api';
import { currentToken } from '../api/token';
import type { CameraStatus } from '../api/types';
import { SampleRate } from '../live/rate';
import { isOld, whyOld } from './age';

/** s between two questions for a picture, while pictures come, and while there is none. */
const EVERY = 0.1;
const IDLE = 2;
/** ms between two looks at how old the picture is, also while no answer comes. */
const AGED_EVERY = 250;

export class Camera {
  status = $state.raw<CameraStatus | null>(null);
  /** Why nothing is shown; empty if something is. */
  problem = $state('');
  picture = $state.raw<ImageBitmap | null>(null);
  /** s on this page's clock when the picture was taken. */
  private takenAt = -Infinity;
  private number = 0;
  private timer = 0;
  /** s on this page's clock of the question without an answer; null for none. */
  private askedAt: number | null = null;
  private isClosed = false;
  age = $state<number | null>(null);
  /** Pictures a second that are shown; null while too few have come. */
  rate = $state<number | null>(null);
  private readonly received = new SampleRate();
  isStale: boolean = $derived(this.age === null || isOld(this.age));
  /** Why the picture is old; empty while it is live. */
  why = $state('');

  /** Shows pictures until the returned function is called. */
  follow(): () => void {
    void this.turn();
    const aging = setInterval(() => this.grow(), AGED_EVERY);
    return () => {
      this.isClosed = true;
      clearInterval(aging);
      clearTimeout(this.timer);
      this.picture?.close();
    };
  }

  private async turn(): Promise<void> {
    let isThere = false;
    this.askedAt = performance.now() / 1000;
    try {
      if (document.visibilityState === 'visible') {
        isThere = await this.next();
        if (!isThere && (this.age === null || isOld(this.age)))
          this.status = await ask(api.GET('/api/v1/robots/{robot}/camera', { params: { path: here() } }));
        this.problem = this.status?.problem ?? '';
      }
    } catch (error) {
      this.problem = asProblem(error).detail;
    }
    this.askedAt = null;
    this.grow();
    if (this.isClosed) return;
    const isIdle = this.problem !== '' || this.status?.source === 'none';
    this.timer = window.setTimeout(() => void this.turn(), (isIdle ? IDLE : EVERY) * 1000);
  }

  private grow(): void {
    const now = performance.now() / 1000;
    this.rate = this.received.rate(now);
    this.age = Number.isFinite(this.takenAt) ? now - this.takenAt : null;
    this.why = this.isStale ? whyOld(this.problem, this.askedAt === null ? 0 : now - this.askedAt) : '';
  }

  /** Takes the next picture; whether there was one. Throws a Problem. */
  private async next(): Promise<boolean> {
    const token = currentToken();
    const headers = token === null ? undefined : { Authorization: `Bearer ${token}` };
    const answer = await fetch(addressOf(`/camera/picture?after=${this.number}`), headers && { headers });
    if (answer.status !== 200) return false;
    const age = Number(answer.headers.get('Camera-Age') ?? 0);
    this.takenAt = performance.now() / 1000 - age;
    this.received.heard(this.takenAt);
    this.number = Number(answer.headers.get('Camera-Picture') ?? 0);
    const picture = await createImageBitmap(await answer.blob());
    this.picture?.close();
    this.picture = picture;
    return true;
  }
}
