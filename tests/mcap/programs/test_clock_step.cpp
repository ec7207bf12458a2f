// The system's clock is set while a test runs.
#include "tests/mcap/bench.hpp"

#include <cstdlib>
#include <fstream>

using namespace lbea::test;

namespace {

void set_step(const std::string& file, long long seconds) {
  std::fstream out(file, std::ios::binary | std::ios::in | std::ios::out);  // in place: the file is mapped
  out.write(reinterpret_cast<const char*>(&seconds), sizeof seconds);
}

}  // namespace

TEST_CASE("a step of the system's clock neither cuts nor extends a recorded window, and is logged") {
  for (const long long step_s : {10, -3600}) {
    CAPTURE(step_s);
    Bench bench;
    std::ofstream(bench.file("step")) << std::string(sizeof(long long), '\0');
    std::optional<OtherSystem> stepping(std::in_place, "LBEA_CLOCK_STEP", bench.file("step"));
    const auto server = bench.serve({"--record", bench.file("run.mcap"), "--record-window", "60:1"});
    stepping.reset();
    WireContext context;
    Camera camera(context, bench.frames());
    for (std::uint64_t id = 0; id < 5; ++id) camera.send(id);
    std::this_thread::sleep_for(100ms);  // until they are received
    server->signal(SIGUSR1);
    REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "recording: triggered"); }));
    set_step(bench.file("step"), step_s);
    for (std::uint64_t id = 5; id < 10; ++id) camera.send(id);
    camera.end(10);
    CHECK(eventually([&] { return std::filesystem::exists(bench.file("run.mcap")); }));
    CHECK(stop(*server) == 0);
    CHECK(bench.inspect("run.mcap", 0)["frames"] == 10);
    CHECK(
        contains(text_of(bench.file("serve.err")), "the system's clock stepped by " + std::to_string(step_s) + ".0 s"));
  }
}
