#version 330
// Red: part of the body; green: number of the person; blue: whether the texel is skin. Hands always are.
in vec3 position;
in vec3 normal;
in vec2 coordinate;
in float part;
uniform sampler2D skin_mask;
uniform float person;
out vec4 colour;

void main() {
  bool eye = part > 90.0;
  bool hand = part > 2.5 && part < 4.5;
  bool clothed = part > 6.5;
  float skin = hand ? 1.0 : (clothed ? 0.0 : texture(skin_mask, coordinate).r);
  if (person < 0.5) { colour = vec4(0.0); return; }
  colour = vec4((eye ? 1.0 : part) / 255.0, person / 255.0, skin > 0.5 ? 1.0 : 0.0, 1.0);
}
