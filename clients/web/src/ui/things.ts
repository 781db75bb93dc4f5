// What can be placed in a running world.
export interface Thing {
  name: string;
  model: string;
  text: string;
} // a model's name, or SDF

const kBox = `<?xml version="1.0"?><sdf version="1.9"><model name="box"><link name="link"><inertial><mass>5</mass>
<inertia><ixx>0.13</ixx><iyy>0.13</iyy><izz>0.13</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>
<collision name="c"><geometry><box><size>0.4 0.4 0.4</size></box></geometry></collision>
<visual name="v"><geometry><box><size>0.4 0.4 0.4</size></box></geometry><material><diffuse>0.85 0.6 0.25 1</diffuse></material></visual></link></model></sdf>`;

export const kThings: Thing[] = [
  { name: "a box", model: "", text: kBox },
  { name: "Pioneer 3-AT", model: "p3at", text: "" },
  { name: "Pioneer 3-DX", model: "p3dx", text: "" },
];
