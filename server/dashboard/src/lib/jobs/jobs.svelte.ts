/** Jobs of a page: loaded once, then followed over the live socket. */

import { api, ask, asProblem, here, type Job, type JobRequest, type Problem } from '../api';
import { live } from '../live/live.svelte';
import { afterSeconds, Reload } from '../reload/reload';
import { merged, type JobKind } from './jobs';

const AT_ONCE = 100;

export class Jobs {
  private readonly kinds: readonly JobKind[];
  /** Null before they have been loaded. */
  private loaded = $state.raw<readonly Job[] | null>(null);
  problem = $state.raw<Problem | null>(null);
  /** The newest first. */
  readonly all: readonly Job[] | null = $derived.by(() =>
    this.loaded === null ? null : merged(this.loaded, live.jobs, this.kinds),
  );

  private readonly reload = new Reload({ load: () => void this.load(), after: afterSeconds });

  constructor(kinds: readonly JobKind[]) {
    this.kinds = kinds;
  }

  /** For an effect that follows how often the connection has come back. */
  afterHealing(times: number): void {
    this.reload.afterHealing(times);
  }

  /** Loads the newest. */
  async load(): Promise<void> {
    try {
      const pages = await Promise.all(
        this.kinds.map((kind) =>
          ask(
            api.GET('/api/v1/robots/{robot}/jobs', {
              params: { path: here(), query: { kind, limit: AT_ONCE } },
            }),
          ),
        ),
      );
      this.loaded = pages.flatMap((page) => page.items as Job[]);
      this.problem = null;
    } catch (error) {
      this.problem = asProblem(error);
    }
  }

  /** Begins a job. Throws a Problem. */
  async begin(request: JobRequest): Promise<Job> {
    const job = (await ask(
      api.POST('/api/v1/robots/{robot}/jobs', { params: { path: here() }, body: request as never }),
    )) as Job;
    this.loaded = [job, ...(this.loaded ?? [])];
    return job;
  }

  /** Ends a job that waits or runs. Throws a Problem. */
  async cancel(job: string): Promise<void> {
    await ask(api.POST('/api/v1/robots/{robot}/jobs/{job}/cancel', { params: { path: { ...here(), job } } }));
  }

  /** Takes an ended job and its result away. Throws a Problem. */
  async remove(job: string): Promise<void> {
    await ask(api.DELETE('/api/v1/robots/{robot}/jobs/{job}', { params: { path: { ...here(), job } } }));
    this.loaded = (this.loaded ?? []).filter((one) => one.id !== job);
  }
}
