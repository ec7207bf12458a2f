// write_plates FILE: a small model with a channel for tests that must not link our own libraries, and FILE.compact with
// fields in 16 bits.
#include "tests/support/synthetic_model.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  using namespace lbea::test;
  lbea::bake::EnsembleDescription description = bent_plates_description();
  description.channels = {
      {"free end", lbea::ChannelKind::displacement, lbea::ChannelComponent::z, 0, {{true, 1020, {}}}, {}}};
  bake_model(bent_plates(), description, argv[1]);
  description.channels.clear();
  description.compact_fields = true;
  bake_model(bent_plates(), description, std::string(argv[1]) + ".compact");
}
