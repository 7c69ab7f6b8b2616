/** Traces that only the archive has: the service fetches one when it is opened, and says how far it is. */

import { Problem } from '../api/problem';

/** ms between two questions. */
const ASK_EVERY = 1000;
const IN_ARCHIVE = 'trace-in-archive';

/** Waits for so many ms. */
export type Pause = (ms: number) => Promise<void>;

const pause: Pause = (ms) => new Promise((done) => setTimeout(done, ms));

/**
 * What `request` gives, asked again while the service fetches the trace; `tell` is told how far that is, and an empty
 * text at the end. `goesOn` says whether anybody still wants it. Throws a Problem.
 */
export async function fromArchive<T>(
  request: () => Promise<T>,
  tell: (text: string) => void,
  goesOn: () => boolean = () => true,
  wait: Pause = pause,
): Promise<T> {
  try {
    for (;;) {
      try {
        return await request();
      } catch (error) {
        if (!(error instanceof Problem) || error.kind !== IN_ARCHIVE || !goesOn()) throw error;
        tell(error.detail);
      }
      await wait(ASK_EVERY);
    }
  } finally {
    tell('');
  }
}
