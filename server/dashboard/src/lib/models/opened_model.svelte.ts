/**
 * One model that is looked at: its parameters, what the job that made it found of them, and its newest validation. What
 * asks the service is handed in.
 */

import { asProblem, type Problem } from '../api/problem';
import type { DiagnosisData, FitData, ModelDetails, ModelParameter, ValidationData } from '../api/types';
import type { JobResult } from '../jobs/opened.svelte';
import { ofDiagnosis, ofFit, parameterRows, type FoundInterval } from './parameters';

/** The number of the model that the machine file describes. */
export const MACHINE = 'machine';

export interface ModelRequests {
  /** Parameters of the machine file's own model. */
  ofMachine(): Promise<readonly ModelParameter[]>;
  model(id: string): Promise<ModelDetails>;
  result(job: string): Promise<JobResult>;
  remove(id: string): Promise<unknown>;
  save(id: string): Promise<void>;
}

export class OpenedModel {
  /** Null for the machine's own, and until they are known. */
  details = $state.raw<ModelDetails | null>(null);
  /** Null until they are known. */
  parameters = $state.raw<readonly ModelParameter[] | null>(null);
  /** The fit that made it. */
  fit = $state.raw<FitData | null>(null);
  validation = $state.raw<ValidationData | null>(null);
  problem = $state.raw<Problem | null>(null);
  private intervals = $state.raw<ReadonlyMap<string, FoundInterval>>(new Map());

  constructor(
    readonly id: string,
    private readonly requests: ModelRequests,
  ) {}

  get rows() {
    return parameterRows(this.parameters ?? [], this.intervals);
  }

  async load(): Promise<void> {
    this.problem = null;
    await this.tried(async () => {
      if (this.id === MACHINE) {
        this.parameters = await this.requests.ofMachine();
        return;
      }
      const details = await this.requests.model(this.id);
      this.details = details;
      this.parameters = details.parameters;
      if (details.entry.job !== null) await this.loadMaker(details.entry.job);
    });
  }

  /** Loads what a validation of it found. */
  async loadValidation(job: string): Promise<void> {
    await this.tried(async () => {
      const result = await this.requests.result(job);
      if (result.kind === 'validate') this.validation = result.data as ValidationData;
    });
  }

  /** Takes it away. Whether it is gone. */
  remove(): Promise<boolean> {
    this.problem = null;
    return this.tried(() => this.requests.remove(this.id));
  }

  save(): Promise<boolean> {
    this.problem = null;
    return this.tried(() => this.requests.save(this.id));
  }

  /** What the job that made it says of its parameters; nothing where the job was taken away. */
  private async loadMaker(job: string): Promise<void> {
    try {
      const result = await this.requests.result(job);
      if (result.kind === 'fit') {
        this.fit = result.data as FitData;
        this.intervals = ofFit(this.fit.parameters);
      } else if (result.kind === 'diagnose') {
        this.intervals = ofDiagnosis(result.data as DiagnosisData);
      }
    } catch (error) {
      if (asProblem(error).status !== 404) throw error;
    }
  }

  private async tried(order: () => Promise<unknown>): Promise<boolean> {
    try {
      await order();
      return true;
    } catch (error) {
      this.problem = asProblem(error);
      return false;
    }
  }
}
