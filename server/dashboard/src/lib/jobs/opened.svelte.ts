/**
 * One job that is looked at, on whichever page: itself, its result, its files, and taking it away. What asks the service
 * is handed in.
 */

import { asProblem, type Problem } from '../api/problem';
import type { Job } from '../api/types';
import type { JobKind } from './jobs';

/** A result of a job, as the service tells it: `kind` says what `data` is. */
export interface JobResult {
  readonly kind: string;
  readonly data: unknown;
}

export interface JobRequests {
  job(id: string): Promise<Job>;
  result(id: string): Promise<JobResult>;
  save(path: string, name: string): Promise<void>;
}

/** As much of a page's list of jobs as is needed. */
export interface JobList {
  /** Null before they have been loaded. */
  readonly all: readonly Job[] | null;
  readonly problem: Problem | null;
  remove(job: string): Promise<void>;
}

export class OpenedJob {
  result = $state.raw<JobResult | null>(null);
  /** Why the job or its result could not be loaded. It is asked for again by `retry`. */
  problem = $state.raw<Problem | null>(null);
  /** What else could not be done: a file, taking it away. */
  refused = $state.raw<Problem | null>(null);
  /** The job, when it is older than the list. */
  private alone = $state.raw<Job | null>(null);
  private removed = $state(false);
  private isAsking = false;

  /** `shown`: kinds of jobs whose result is shown where this one is. */
  constructor(
    readonly id: string,
    private readonly jobs: JobList,
    private readonly shown: readonly JobKind[],
    private readonly requests: JobRequests,
  ) {}

  /** Null until it is known. */
  get job(): Job | null {
    return this.jobs.all?.find((one) => one.id === this.id) ?? this.alone;
  }

  /** Whether its result is to come. */
  get isAwaited(): boolean {
    const { job } = this;
    return (
      job !== null && this.result === null && job.state === 'done' && this.shown.includes(job.request.kind)
    );
  }

  /** Asks for what is missing: for an effect. */
  follow(): void {
    if (this.problem !== null || this.removed) return;
    const isListed = this.jobs.all !== null || this.jobs.problem !== null;
    if (this.isAwaited) {
      void this.load(
        () => this.requests.result(this.id),
        (result) => (this.result = result),
      );
    } else if (this.job === null && isListed) {
      void this.load(
        () => this.requests.job(this.id),
        (job) => (this.alone = job),
      );
    }
  }

  retry(): void {
    this.problem = null;
    this.follow();
  }

  async save(file: string, ending: string): Promise<void> {
    await this.tried(() =>
      this.requests.save(
        `/jobs/${this.id}/${file}`,
        `${this.job?.request.kind ?? 'job'}-${this.id}.${ending}`,
      ),
    );
  }

  /** Takes it away. Whether it is gone. */
  async remove(): Promise<boolean> {
    this.removed = true;
    this.removed = await this.tried(() => this.jobs.remove(this.id));
    return this.removed;
  }

  /** One request at a time. It has ended before anything is told, since whoever is told looks at once for the next. */
  private async load<T>(request: () => Promise<T>, take: (found: T) => void): Promise<void> {
    if (this.isAsking) return;
    this.isAsking = true;
    const told = await request().then(
      (found) => () => take(found),
      (error: unknown) => () => {
        this.problem = asProblem(error);
      },
    );
    this.isAsking = false;
    told();
  }

  private async tried(order: () => Promise<void>): Promise<boolean> {
    this.refused = null;
    try {
      await order();
      return true;
    } catch (error) {
      this.refused = asProblem(error);
      return false;
    }
  }
}
