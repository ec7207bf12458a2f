// Another model is copied (cp) over the file of a running matcher.
#include "tests/mcap/bench.hpp"

using namespace lbea::test;

namespace {

/// A matcher with a copy of the model that the test may overwrite.
std::unique_ptr<Process> serve_copy(Bench& bench, const std::string& method, std::vector<std::string> more = {}) {
  std::filesystem::copy_file(LBEA_MODEL, bench.file("model.lbea"));
  std::vector<std::string> arguments{LBEA_SERVE,  bench.file("model.lbea"),
                                     "--frames",  bench.frames(),
                                     "--results", bench.results(),
                                     "--method",  method,
                                     "--pose",    rail_pose,
                                     "--json"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return bench.start(arguments, "serve", "ready: frames on ");
}

void overwrite(const Bench& bench) {
  std::filesystem::copy_file(LBEA_OTHER_MODEL, bench.file("model.lbea"),
                             std::filesystem::copy_options::overwrite_existing);
}

/// The best match of frame 3, sent as the only one of this session.
lbea::Match matched(Camera& camera, ResultSource& results, std::uint64_t session) {
  camera.send(3, session);
  camera.end(4, session);
  WireResult result;
  while (true) {
    const auto message = results.receive(30s);
    REQUIRE(message);
    if (decode_result(*message, result) != WireStatus::ok || result.session != session) continue;
    REQUIRE(fate_of(result.status) == Fate::matched);
    return {result.matches.front().sample, result.matches.front().distance};
  }
}

}  // namespace

TEST_CASE("cp over the model of a running matcher: frames are matched as before, and the log says what to do") {
  for (const std::string method : {"lbea", "fit", "vtp"}) {
    CAPTURE(method);
    Bench bench;
    const auto server = serve_copy(bench, method);
    WireContext context;
    ResultSource results(context, bench.results());
    REQUIRE(results.receive(30s));
    Camera camera(context, bench.frames());
    camera.look_from(rail_pose);
    const lbea::Match before = matched(camera, results, 1);
    overwrite(bench);
    CHECK(
        eventually([&] { return contains(text_of(bench.file("serve.err")), "still matched with the former model"); }));
    const lbea::Match after = matched(camera, results, 2);
    CHECK(after.sample == before.sample);
    CHECK(after.distance == before.distance);
    CHECK(stop(*server) == 0);
  }
}

TEST_CASE("cp over a model that is too large for a copy in memory ends the matcher with a sentence") {
  Bench bench;
  std::optional<OtherSystem> small(std::in_place, "LBEA_MEMORY_PAGES", "3000");  // 12 MB, three quarters for 11 MB
  const auto server = serve_copy(bench, "vtp", {"--queue", "2", "--max-points", "100000"});
  small.reset();
  WireContext context;
  ResultSource results(context, bench.results());
  REQUIRE(results.receive(30s));
  Camera camera(context, bench.frames());
  camera.look_from(rail_pose);
  matched(camera, results, 1);
  overwrite(bench);
  CHECK(server->wait() == 1);
  const std::string log = text_of(bench.file("serve.err"));
  CHECK_MESSAGE((contains(log, "was written to while frames are matched with it: the program ends") ||
                 contains(log, "a file became shorter while it was read")),
                log);
}

TEST_CASE("a program whose model becomes shorter while it is read ends with a sentence (SIGBUS)") {
  Bench bench;
  const auto server = serve_copy(bench, "lbea");
  const auto evaluation = bench.start({LBEA_EVAL, "live", bench.file("model.lbea"), "--results", bench.results()},
                                      "eval", "lbea-eval: ready");
  std::filesystem::resize_file(bench.file("model.lbea"), 0);
  WireContext context;
  Camera camera(context, bench.frames());
  camera.look_from(rail_pose);
  camera.send(3);
  camera.end(4);
  CHECK(evaluation->wait() == 1);
  const std::string log = text_of(bench.file("eval.err"));
  CHECK_MESSAGE(contains(log, "error: a file became shorter while it was read"), log);
}
