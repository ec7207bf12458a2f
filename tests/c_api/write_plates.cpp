// write_plates FILE: a small model for tests that must not link our own libraries, and FILE.compact with fields in 16
// bits.
#include "tests/support/synthetic_model.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  using namespace lbea::test;
  bake_bent_plates(argv[1]);
  lbea::bake::EnsembleDescription description = bent_plates_description();
  description.compact_fields = true;
  bake_model(bent_plates(), description, std::string(argv[1]) + ".compact");
}
