#version 330
// Red: part of the body; green: number of the person; blue: whether the texel is skin. Hands always are.
in vec3 position;
in vec3 normal;
in vec2 coordinate;
flat in float whole_part;
uniform sampler2D skin_mask;
uniform float person;
out vec4 colour;

void main() {
  bool eye = whole_part > 90.0;
  bool hand = whole_part > 2.5 && whole_part < 4.5;
  bool clothed = whole_part > 6.5;
  float skin = hand ? 1.0 : (clothed ? 0.0 : texture(skin_mask, coordinate).r);
  if (person < 0.5) { colour = vec4(0.0); return; }
  colour = vec4((eye ? 1.0 : whole_part) / 255.0, person / 255.0, skin > 0.5 ? 1.0 : 0.0, 1.0);
}
