/** The types of the API under their own names: requests as sent, answers as told. All come from the service's description (schema.d.ts). */

import type { components } from './schema';

type Schemas = components['schemas'];

/**
 * A message as the service tells it: it writes out every field, also those that a request may leave out because they
 * have a default.
 */
export type Told<T> = T extends object ? { [K in keyof T]-?: Told<T[K]> } : T;

export type CatalogueEntry = Told<Schemas['CatalogueEntry']>;
export type Control = Told<Schemas['Control']>;
export type ControlLease = Told<Schemas['ControlLease']>;
export type Experiment = Told<Schemas['Experiment']>;
export type ExperimentPreset = Told<Schemas['ExperimentPreset']>;
export type ExperimentRequest = Schemas['ExperimentRequest'];
export type ExperimentSpec = Schemas['ExperimentSpec'];
export type Health = Told<Schemas['Health']>;
export type Job = Told<Schemas['Job']>;
export type JobRequest = Schemas['Job']['request'];
export type Machine = Told<Schemas['Machine']>;
export type Me = Told<Schemas['Me']>;
export type ModelDetails = Told<Schemas['ModelDetails']>;
export type ModelEntry = Told<Schemas['ModelEntry']>;
export type MotionPreview = Told<Schemas['MotionPreview']>;
export type ProcessState = Told<Schemas['ProcessState']>;
export type QueueStatus = Told<Schemas['QueueStatus']>;
export type RobotStatus = Told<Schemas['RobotStatus']>;
export type Schedule = Told<Schemas['Schedule']>;
export type ServiceEvent = Told<Schemas['ServiceEvent']>;
export type StopResult = Told<Schemas['StopResult']>;
export type SystemStatus = Told<Schemas['SystemStatus']>;
export type TeachingStatus = Told<Schemas['TeachingStatus']>;
export type TraceDetails = Told<Schemas['TraceDetails']>;
export type TraceSignals = Told<Schemas['TraceSignals']>;

export type HistoryMessage = Told<Schemas['HistoryMessage']>;
export type LinkMessage = Told<Schemas['LinkMessage']>;
export type LiveFrame = Told<Schemas['LiveFrame']>;
export type LiveMessage = LiveFrame['messages'][number];
export type ProgressMessage = Told<Schemas['ProgressMessage']>;
export type RecordEventMessage = Told<Schemas['RecordEventMessage']>;
export type RobotMessage = Told<Schemas['RobotMessage']>;
export type SampleMessage = Told<Schemas['SampleMessage']>;

export type Topic = 'samples' | 'robot' | 'link' | 'queue' | 'jobs' | 'events' | 'teaching';

/** What a client sends over the live socket (`LiveRequest` of the service). */
export interface LiveRequest {
  subscribe?: Topic[];
  unsubscribe?: Topic[];
  rate?: 50 | 25 | 10 | 5 | 1;
  history?: number;
  points?: number;
  jog?: { lease: string; velocities: Record<number, number> };
}
