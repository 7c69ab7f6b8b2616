/** The types of the API under their own names: requests as sent, answers as told. All come from the service's description (schema.d.ts). */

import type { components } from './schema';

type Schemas = components['schemas'];

/**
 * A message as the service tells it: it writes out every field, also those that a request may leave out because they
 * have a default. Tuples are told as lists, as openapi-fetch has them.
 */
export type Told<T> = T extends readonly (infer Item)[]
  ? Told<Item>[]
  : T extends object
    ? { [Key in keyof T]-?: Told<T[Key]> }
    : T;

export type AuditEntry = Told<Schemas['AuditEntry']>;
export type CameraStatus = Told<Schemas['CameraStatus']>;
export type CatalogueEntry = Told<Schemas['CatalogueEntry']>;
export type ComparisonData = Told<Schemas['ComparisonData']>;
export type ConsoleCommand = Told<Schemas['ConsoleCommand']>;
export type ConsoleOrder = Told<Schemas['ConsoleOrder']>;
export type Control = Told<Schemas['Control']>;
export type ControlLease = Told<Schemas['ControlLease']>;
export type Dependence = Told<Schemas['Dependence']>;
export type Destination = Told<Schemas['DestinationStatus']>;
export type DiagnosisData = Told<Schemas['DiagnosisData']>;
export type DiagnosisStep = Told<Schemas['DiagnosisStep']>;
export type Experiment = Told<Schemas['Experiment']>;
export type ExperimentPreset = Told<Schemas['ExperimentPreset']>;
export type ExperimentRequest = Schemas['ExperimentRequest'];
export type ExperimentSpec = Schemas['ExperimentSpec'];
export type Fidelity = Told<Schemas['Fidelity']>;
export type FleetRobot = Told<Schemas['FleetRobot']>;
export type FitData = Told<Schemas['FitData']>;
export type FittedParameter = Told<Schemas['FittedParameter']>;
export type FoundValue = Told<Schemas['FoundValue']>;
export type Health = Told<Schemas['Health']>;
export type Hidden = Told<Schemas['Hidden']>;
export type HiddenNumber = Told<Schemas['HiddenNumber']>;
export type HidingPlace = Told<Schemas['HidingPlace']>;
export type Job = Told<Schemas['Job']>;
export type JobRequest = Schemas['Job']['request'];
export type KnownEffect = Told<Schemas['KnownEffect']>;
export type KeptMacro = Told<Schemas['KeptMacro']>;
export type Machine = Told<Schemas['Machine']>;
export type Macro = Told<Schemas['Macro']>;
export type MacroReading = Told<Schemas['MacroReading']>;
export type Macros = Told<Schemas['Macros']>;
export type Me = Told<Schemas['Me']>;
export type Meshes = Told<Schemas['Meshes']>;
export type ModelAgreement = Told<Schemas['ModelAgreement']>;
export type ModelDetails = Told<Schemas['ModelDetails']>;
export type ModelEntry = Told<Schemas['ModelEntry']>;
export type ModelLineage = Told<Schemas['ModelLineage']>;
export type ModelParameter = Told<Schemas['ModelParameter']>;
export type MotionPreview = Told<Schemas['MotionPreview']>;
export type NextExperiment = Told<Schemas['NextExperiment']>;
export type Overlay = Told<Schemas['Overlay']>;
export type ParameterWords = Told<Schemas['ParameterWords']>;
export type PhaseCell = Told<Schemas['PhaseCell']>;
export type PlannedRun = Told<Schemas['PlannedRun']>;
export type ProcessState = Told<Schemas['ProcessState']>;
export type QueueStatus = Told<Schemas['QueueStatus']>;
export type RobotStatus = Told<Schemas['RobotStatus']>;
export type Schedule = Told<Schemas['Schedule']>;
export type Approval = Told<Schemas['Approval']>;
export type Reviewer = NonNullable<Schedule['needs_approval_of']>;
export type ServiceEvent = Told<Schemas['ServiceEvent']>;
export type GapStage = Told<Schemas['GapStage']>;
export type SignalError = Told<Schemas['SignalError']>;
export type StopResult = Told<Schemas['StopResult']>;
export type SystemStatus = Told<Schemas['SystemStatus']>;
export type TeachingStatus = Told<Schemas['TeachingStatus']>;
export type TraceDetails = Told<Schemas['TraceDetails']>;
export type TraceSignals = Told<Schemas['TraceSignals']>;
export type TriedEffect = Told<Schemas['TriedEffect']>;
export type ValidationData = Told<Schemas['ValidationData']>;

export type HistoryMessage = Told<Schemas['HistoryMessage']>;
export type LinkMessage = Told<Schemas['LinkMessage']>;
export type LiveFrame = Told<Schemas['LiveFrame']>;
export type LiveMessage = LiveFrame['messages'][number];
export type ProgramEntry = Told<Schemas['ProgramEntry']>;
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
