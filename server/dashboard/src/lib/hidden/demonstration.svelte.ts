/** The demonstration as the page follows it: asked for again and again until its secret is open. */

import { api, ask, asProblem, here, type Problem } from '../api';
import type { ComparisonData, DiagnosisData, Hidden, HidingPlace, Job } from '../api/types';
import { JOB_REQUESTS } from '../jobs/job_requests';

/** ms between two looks. */
const LOOK_EVERY = 400;
const SEEN = 'ma2000-hidden';

export class Demonstration {
  place = $state.raw<HidingPlace | null>(null);
  problem = $state.raw<Problem | null>(null);
  busy = $state(false);
  job = $state.raw<Job | null>(null);
  comparison = $state.raw<ComparisonData | null>(null);
  found = $state.raw<DiagnosisData | null>(null);
  /** The demonstration that this tab has seen, also before it was loaded anew; another's is not shown as new. */
  private mine = $state(sessionStorage.getItem(SEEN));
  private timer: ReturnType<typeof setTimeout> | null = null;
  private closed = false;

  get hidden(): Hidden | null {
    const latest = this.place?.latest ?? null;
    return latest !== null && (latest.id === this.mine || this.isGoingOn(latest)) ? latest : null;
  }

  async start(): Promise<void> {
    await this.look();
  }

  stop(): void {
    this.closed = true;
    if (this.timer !== null) clearTimeout(this.timer);
  }

  async hide(effect: string | null, joint: number | null): Promise<void> {
    this.busy = true;
    this.problem = null;
    this.job = this.comparison = this.found = null;
    try {
      const body = { effect, joint } as never;
      const begun = await ask(api.POST('/api/v1/robots/{robot}/hidden', { params: { path: here() }, body }));
      this.see(begun.id);
      await this.look();
    } catch (error) {
      this.problem = asProblem(error);
    } finally {
      this.busy = false;
    }
  }

  /** Ends the search; the secret is then opened without an answer. Throws a Problem. */
  async cancel(job: string): Promise<void> {
    await ask(api.POST('/api/v1/robots/{robot}/jobs/{job}/cancel', { params: { path: { ...here(), job } } }));
  }

  private see(id: string): void {
    this.mine = id;
    sessionStorage.setItem(SEEN, id);
  }

  private isGoingOn(hidden: Hidden): boolean {
    return hidden.state === 'recording' || hidden.state === 'diagnosing';
  }

  private async look(): Promise<void> {
    if (this.timer !== null) clearTimeout(this.timer);
    try {
      this.place = await ask(api.GET('/api/v1/robots/{robot}/hidden', { params: { path: here() } }));
      const { hidden } = this;
      if (hidden !== null) await this.follow(hidden);
    } catch (error) {
      this.problem = asProblem(error);
    }
    const { hidden } = this;
    const isAwaited =
      hidden !== null &&
      (this.isGoingOn(hidden) || (hidden.secret && hidden.secret.outcome !== 'unanswered' && !this.found));
    if (isAwaited && !this.closed) this.timer = setTimeout(() => void this.look(), LOOK_EVERY);
  }

  /** Asks for what has come since: the simulation of the machine file, the candidates, the answer. */
  private async follow(hidden: Hidden): Promise<void> {
    if (this.mine !== hidden.id) this.see(hidden.id);
    if (hidden.comparison !== null && this.comparison === null) {
      const job = await JOB_REQUESTS.job(hidden.comparison);
      if (job.state === 'done') {
        this.comparison = (await JOB_REQUESTS.result(job.id)).data as ComparisonData;
      }
    }
    if (hidden.diagnosis !== null && this.found === null) {
      const job = await JOB_REQUESTS.job(hidden.diagnosis);
      // What led last stays: an ended job tells of no candidates any more.
      this.job = job.leading.length > 0 || this.job === null ? job : { ...job, leading: this.job.leading };
      if (job.state === 'done') {
        this.found = (await JOB_REQUESTS.result(job.id)).data as DiagnosisData;
      }
    }
  }
}
