#version 330
// How much of a pixel a person covers: drawn with several samples a pixel, then averaged.
out vec4 colour;

void main() {
  colour = vec4(1.0);
}
