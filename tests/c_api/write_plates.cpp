// write_plates FILE: a small model for tests that must not link our own libraries.
#include "tests/support/synthetic_model.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  lbea::test::bake_bent_plates(argv[1]);
}
