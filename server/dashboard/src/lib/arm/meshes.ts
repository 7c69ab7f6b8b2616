/** The meshes of the URDF beside the machine file, as geometries in the frames of its joints. Loaded last of all. */

import { Matrix4, Mesh, type Object3D } from 'three';
import { addressOf, api, ask, here } from '../api';
import { currentToken } from '../api/token';
import type { Meshes } from '../api/types';
import { geometriesIn, type PlacedMesh } from './geometries';

/** All meshes of this robot, if it is of this machine; none if there are none. Throws what the network throws. */
export async function loadMeshes(machine: string): Promise<PlacedMesh[]> {
  const found = await ask(api.GET('/api/v1/robots/{robot}/meshes', { params: { path: here() } }));
  if (found.machine !== machine) return [];
  return (await Promise.all(found.meshes.map(load))).flat();
}

async function load(mesh: Meshes['meshes'][number]): Promise<PlacedMesh[]> {
  const token = currentToken();
  const headers = token === null ? undefined : { Authorization: `Bearer ${token}` };
  const answer = await fetch(addressOf(`/meshes/${mesh.number}`), headers && { headers });
  if (!answer.ok) return [];
  const pose = new Matrix4().set(...(mesh.pose as Parameters<Matrix4['set']>));
  return geometriesIn(await parsed(mesh.kind, await answer.arrayBuffer())).map((geometry) => ({
    joint: mesh.joint,
    geometry: geometry.applyMatrix4(pose),
  }));
}

async function parsed(kind: 'stl' | 'dae' | 'obj', bytes: ArrayBuffer): Promise<Object3D> {
  if (kind === 'stl') {
    const { STLLoader } = await import('three/examples/jsm/loaders/STLLoader.js');
    return new Mesh(new STLLoader().parse(bytes));
  }
  const text = new TextDecoder().decode(bytes);
  if (kind === 'obj') {
    const { OBJLoader } = await import('three/examples/jsm/loaders/OBJLoader.js');
    return new OBJLoader().parse(text);
  }
  const { ColladaLoader } = await import('three/examples/jsm/loaders/ColladaLoader.js');
  const scene = new ColladaLoader().parse(text, '')?.scene ?? new Mesh();
  scene.rotation.set(0, 0, 0); // a URDF has the file's own axes, which the loader turns to three.js' own
  return scene;
}
