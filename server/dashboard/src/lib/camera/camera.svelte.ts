/** The camera beside the arm: its newest picture and how old that is. The service is asked only while it is shown. */

import { api, ask, here, addressOf, asProblem } from '../api';
import { currentToken } from '../api/token';
import type { CameraStatus } from '../api/types';
import { isOld } from './age';

/** s between two questions for a picture, while pictures come, and while there is none. */
const EVERY = 0.1;
const IDLE = 2;

export class Camera {
  status = $state.raw<CameraStatus | null>(null);
  /** Why nothing is shown; empty if something is. */
  problem = $state('');
  picture = $state.raw<ImageBitmap | null>(null);
  /** s on this page's clock when the picture was taken. */
  private takenAt = -Infinity;
  private number = 0;
  private timer = 0;
  private isClosed = false;
  age = $state<number | null>(null);
  isStale: boolean = $derived(this.age === null || isOld(this.age));

  /** Shows pictures until the returned function is called. */
  follow(): () => void {
    void this.turn();
    return () => {
      this.isClosed = true;
      clearTimeout(this.timer);
      this.picture?.close();
    };
  }

  private async turn(): Promise<void> {
    let isThere = false;
    try {
      if (document.visibilityState === 'visible') {
        isThere = await this.next();
        // Also once beside pictures: a drawn one is called so.
        if (this.status === null || (!isThere && (this.age === null || isOld(this.age))))
          this.status = await ask(api.GET('/api/v1/robots/{robot}/camera', { params: { path: here() } }));
        this.problem = this.status?.problem ?? '';
      }
    } catch (error) {
      this.problem = asProblem(error).detail;
    }
    this.age = Number.isFinite(this.takenAt) ? performance.now() / 1000 - this.takenAt : null;
    if (this.isClosed) return;
    const isIdle = this.problem !== '' || this.status?.source === 'none';
    this.timer = window.setTimeout(() => void this.turn(), (isIdle ? IDLE : EVERY) * 1000);
  }

  /** Takes the next picture; whether there was one. Throws a Problem. */
  private async next(): Promise<boolean> {
    const token = currentToken();
    const headers = token === null ? undefined : { Authorization: `Bearer ${token}` };
    const answer = await fetch(addressOf(`/camera/picture?after=${this.number}`), headers && { headers });
    if (answer.status !== 200) return false;
    const age = Number(answer.headers.get('Camera-Age') ?? 0);
    this.takenAt = performance.now() / 1000 - age;
    this.number = Number(answer.headers.get('Camera-Picture') ?? 0);
    const picture = await createImageBitmap(await answer.blob());
    this.picture?.close();
    this.picture = picture;
    return true;
  }
}
