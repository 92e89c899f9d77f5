// Files that a person chose, as a request body of POST /v1/observations. What is in them is judged by the service, not here.

const RECORDED_VIEWS = 10; // of a recording, which may have hundreds: as many as the paper takes
const IMAGE = /\.(jpe?g|png)$/i;
const inOrder = (left, right) => left.path.localeCompare(right.path, "en", { numeric: true });

/** Something about the files that a person can mend. */
export class WrongFiles extends Error {}

/** {body, headers, views: [File]} of files, each {file, path}; at most so many views. */
export async function burstOf(files, most) {
  const shown = files.filter(({ path }) => !path.split("/").some((part) => part.startsWith(".")));
  const archive = shown.find(({ path }) => /\.npz$/i.test(path));
  if (archive) {
    if (shown.length > 1) throw new WrongFiles(`${archive.path} is a whole burst; drop it alone, without the ${shown.length - 1} other files.`);
    return { body: archive.file, headers: { "Content-Type": "application/x-npz" }, views: [] };
  }
  const named = (name) => shown.filter(({ path }) => path.split("/").pop() === name);
  const recordings = named("scene_camera.json");
  if (recordings.length > 1) throw new WrongFiles(`These are ${recordings.length} recordings, one object each; drop one of their folders.`);
  const parts = partsOf(shown);
  if (recordings.length) return recording(parts, recordings[0], most);
  const [burst] = named("burst.json");
  if (!parts.rgb.length) throw new WrongFiles("There is no JPEG or PNG among these files.");
  return request(burst ? await burst.file.text() : "{}", parts);
}

function partsOf(files) {
  const parts = { rgb: [], depth: [], mask: [] };
  for (const each of files.filter(({ path }) => IMAGE.test(path)).sort(inOrder)) {
    parts[/depth/i.test(each.path) ? "depth" : /mask/i.test(each.path) ? "mask" : "rgb"].push(each);
  }
  return parts;
}

/** A folder in the layout of BOP's scenes: millimetres, camera from world, row by row. */
async function recording(parts, cameras, most) {
  let scene;
  try {
    scene = JSON.parse(await cameras.file.text());
  } catch (error) {
    throw new WrongFiles(`${cameras.path} is not JSON: ${error.message}`);
  }
  const number = ({ path }) => String(Number(/(\d+)(?:_\d+)?\.\w+$/.exec(path)?.[1] ?? NaN));
  const kept = spread(parts.rgb.filter((each) => scene[number(each)]), Math.min(most, RECORDED_VIEWS));
  if (!kept.length) throw new WrongFiles(`No image in rgb/ has a camera in ${cameras.path}; they belong together by their numbers.`);
  const beside = (list) => kept.map((view) => list.find((each) => number(each) === number(view))).filter(Boolean);
  const views = kept.map((view) => viewOf(scene[number(view)], `${cameras.path}, view ${number(view)}`));
  const scale = scene[number(kept[0])].depth_scale;
  const about = { views, ...(parts.depth.length ? { depth_scale: (scale ?? 1) / 1000 } : {}) };
  return request(JSON.stringify(about), { rgb: kept, depth: beside(parts.depth), mask: [] }); // its masks are the truth, which no robot has
}

function viewOf(camera, where) {
  const { cam_K: K, cam_R_w2c: R, cam_t_w2c: t } = camera;
  for (const [name, value, length] of [["cam_K", K, 9], ["cam_R_w2c", R, 9], ["cam_t_w2c", t, 3]]) {
    if (!Array.isArray(value) || value.length !== length) throw new WrongFiles(`${where}: ${name} must be ${length} numbers.`);
  }
  const rows = [0, 1, 2].map((row) => [0, 1, 2].map((column) => R[3 * column + row])); // the inverse of a rotation
  const origin = rows.map((row) => -row.reduce((sum, value, column) => sum + (value * t[column]) / 1000, 0));
  return { K: [K.slice(0, 3), K.slice(3, 6), K.slice(6)], world_from_camera: [...rows.map((row, index) => [...row, origin[index]]), [0, 0, 0, 1]] };
}

function spread(list, most) {
  if (list.length <= most) return list;
  return Array.from({ length: most }, (_, index) => list[Math.floor((index * list.length) / most)]);
}

function request(about, parts) {
  const body = new FormData();
  body.append("burst", new Blob([about], { type: "application/json" }), "burst.json");
  for (const [name, list] of Object.entries(parts)) for (const { file } of list) body.append(name, file, file.name);
  return { body, headers: {}, views: parts.rgb.map(({ file }) => file) };
}
