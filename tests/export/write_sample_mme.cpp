// Writes the sample test to a folder, and what a reader must find in it as JSON to standard output.
#include "tests/export/sample_mme.hpp"

#include <nlohmann/json.hpp>

#include <cstdio>

int main(int, char** arguments) {
  using Json = nlohmann::json;
  const lbea::io::MmeTest test = lbea::test::sample_mme();
  lbea::io::write_mme(arguments[1], test);
  Json channels = Json::array();
  for (const lbea::io::MmeChannel& channel : test.channels) {
    channels.push_back({{"code", channel.code.text()},
                        {"unit", channel.unit},
                        {"first_s", channel.first_s},
                        {"interval_s", channel.interval_s},
                        {"values", Json::array()}});
    for (const double value : channel.values)
      channels.back()["values"].push_back(std::isfinite(value) ? Json(value) : Json(nullptr));
  }
  std::printf("%s\n", channels.dump().c_str());
  return 0;
}
