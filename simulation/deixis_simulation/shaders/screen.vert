#version 330
// One triangle that covers the picture.
in vec2 in_place;

void main() {
  gl_Position = vec4(in_place, 0.0, 1.0);
}
