// lbea-serve with the models of two components: each frame has a result of each, and is counted once.
#include "tests/mcap/bench.hpp"

#include <lbea/inference.hpp>

#include <bit>
#include <functional>
#include <map>

using namespace lbea::test;

namespace {

constexpr std::uint64_t frames = 12;

/// What a matcher with these models publishes about frames 0, 1, ... of the demo, then the end of the stream.
struct Served {
  std::vector<WireResult> results;
  WireState state;
  Json tally;
  int exit_code = 0;
  std::string log;
};

std::vector<std::string> server_arguments(const Bench& bench, const std::vector<std::string>& models,
                                          const std::vector<std::string>& more) {
  std::vector<std::string> arguments{LBEA_SERVE};
  arguments.insert(arguments.end(), models.begin(), models.end());
  for (const std::string& argument : {std::string("--frames"), bench.frames(), std::string("--results"),
                                      bench.results(), std::string("--pose"), rail_pose, std::string("--json")})
    arguments.push_back(argument);
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

void receive(ResultSource& source, Served& served, const std::function<bool(const WireResult&)>& is_last) {
  for (const auto begin = std::chrono::steady_clock::now(); std::chrono::steady_clock::now() - begin < 30s;) {
    const auto message = source.receive(100ms);
    if (!message) continue;
    if (decode_state(*message, served.state) == WireStatus::ok) continue;
    REQUIRE(decode_result(*message, served.results.emplace_back()) == WireStatus::ok);
    if (is_last(served.results.back())) return;
  }
  FAIL("no result");
}

Served serve(const std::vector<std::string>& models, const std::vector<std::string>& more = {}) {
  Bench bench;
  const auto server = bench.start(server_arguments(bench, models, more), "serve", "ready: frames on " + bench.frames());
  WireContext context;
  ResultSource source(context, bench.results());
  const auto hello = source.receive(30s);
  REQUIRE(hello);
  Camera camera(context, bench.frames());
  camera.look_from(rail_pose);
  Served served;
  REQUIRE(decode_state(*hello, served.state) == WireStatus::ok);
  for (std::uint64_t id = 0; id < frames; ++id) {
    camera.send(id);
    std::size_t count = 0;
    receive(source, served, [&](const WireResult&) { return ++count == models.size(); });
  }
  const std::vector<lbea::Point> nothing{{1e6f, 0, 0}};
  camera.send_bytes(camera.encoder().frame({frames, 2000, nothing}, 1));
  camera.end(frames + 1);
  receive(source, served, [](const WireResult& result) { return result.status == WireStatus::end_of_stream; });
  served.exit_code = stop(*server);
  served.tally = Json::parse(text_of(bench.file("serve.out")));
  served.log = text_of(bench.file("serve.err"));
  return served;
}

/// What the matcher found in the frame alone.
void check_same_match(const WireResult& a, const WireResult& b) {
  CHECK(a.status == b.status);
  CHECK(a.verdict == b.verdict);
  CHECK(a.coverage == b.coverage);
  CHECK(std::bit_cast<std::uint32_t>(a.fit.residual) == std::bit_cast<std::uint32_t>(b.fit.residual));  // perhaps NaN
  CHECK(a.model_checksum == b.model_checksum);
  REQUIRE(a.fit.candidates.size() == b.fit.candidates.size());
  for (std::size_t i = 0; i < a.fit.candidates.size(); ++i) {
    CHECK(a.fit.candidates[i].sample == b.fit.candidates[i].sample);
    CHECK(a.fit.candidates[i].distance == b.fit.candidates[i].distance);
  }
  REQUIRE(a.matches.size() == b.matches.size());
  for (std::size_t i = 0; i < a.matches.size(); ++i)
    CHECK(a.matches[i].simulation_name == b.matches[i].simulation_name);
}

std::string refusal(const std::string& arguments) {
  const TemporaryFolder folder;
  const Outcome outcome = run_program(LBEA_SERVE " " + arguments + " --results ipc://r", folder.path());
  CHECK(outcome.exit_code == 2);
  return outcome.err;
}

}  // namespace

TEST_CASE("two components: a result of each per frame, in order, as each alone would have; frames are counted once") {
  const std::vector<std::string> fit{"--method", "fit", "--min-coverage", "0.1"};
  const Served both = serve({LBEA_MODEL, LBEA_OTHER_MODEL}, fit), first = serve({LBEA_MODEL}, fit),
               second = serve({LBEA_OTHER_MODEL}, fit);
  REQUIRE(both.results.size() == 2 * (frames + 1) + 1);
  REQUIRE(first.results.size() == frames + 2);
  for (std::size_t i = 0; i < 2 * (frames + 1); ++i) {
    CAPTURE(i);
    const WireResult& result = both.results[i];
    CHECK(result.component == (i % 2 == 0 ? "rail" : "other"));
    CHECK(result.frame_id == i / 2);
    if (i > 0) CHECK(result.sequence > both.results[i - 1].sequence);
    CHECK(result.counters.sum(Fate::matched) + result.counters.sum(Fate::rejected) >= i / 2 + 1);
    check_same_match(result, (i % 2 == 0 ? first : second).results[i / 2]);
  }
  const WireResult& last = both.results[2 * frames - 1];
  REQUIRE(last.test.frames > 0);
  CHECK(last.test.simulation == both.results[2 * frames - 2].test.simulation);
  CHECK(both.results.back().component.empty());
  REQUIRE(both.state.components.size() == 2);
  CHECK(both.state.components[1].name == "other");
  CHECK(both.state.components[1].model.checksum == both.results[1].model_checksum);
  CHECK(contains(both.log, "rail and other as one run"));
  for (const Served* served : {&both, &first}) {
    CHECK(served->tally["matched"] == frames);
    CHECK(served->tally["rejected_by_reason"]["empty_frame"] == 1);
    CHECK(served->tally["adds_up"] == true);
    CHECK(served->exit_code == 0);
  }
  for (const WireResult& result : first.results) CHECK(result.component.empty());
  CHECK(first.state.components.empty());
}

TEST_CASE("a recording of two components is complete, and gives the same results to the bit") {
  for (const std::vector<std::string>& more : {std::vector<std::string>{"--method", "fit", "--min-coverage", "0.1"},
                                               std::vector<std::string>{"--method", "lbea"}}) {
    const TemporaryFolder folder;
    const std::string recording = (folder / "run.mcap").string();
    std::vector<std::string> arguments = more;
    arguments.insert(arguments.end(), {"--record", recording});
    const Served both = serve({LBEA_MODEL, LBEA_OTHER_MODEL}, arguments);
    CHECK(both.exit_code == 0);
    const Outcome audit = run_program(LBEA_INSPECT " " + recording + " --json", folder.path());
    CAPTURE(audit.err);
    CAPTURE(audit.out);
    CHECK(audit.exit_code == 0);
    const auto replay = [&](const std::string& words) {
      return run_program(LBEA_REPLAY " " + recording + " " + words, folder.path());
    };
    const Outcome same = replay("--model " LBEA_MODEL " --model " LBEA_OTHER_MODEL " --against --json");
    CAPTURE(same.err);
    CHECK(same.exit_code == 0);
    CHECK(Json::parse(same.out)["same"] == 2 * (frames + 1));
    CHECK(replay("--model " LBEA_OTHER_MODEL " --model " LBEA_MODEL " --against --json --threads 2").out == same.out);
    CHECK(contains(replay("--model " LBEA_MODEL " --model " LBEA_OTHER_MODEL).out, " of other"));
    CHECK(contains(replay("--model " LBEA_MODEL).err, "was matched with the models of the components rail, other"));
  }
}

TEST_CASE("components are matched by other methods, and without history, too") {
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--method", "lbea"}, std::vector<std::string>{"--method", "fit", "--frames-alone"}}) {
    const Served both = serve({LBEA_MODEL, LBEA_OTHER_MODEL}, more), second = serve({LBEA_OTHER_MODEL}, more);
    REQUIRE(both.results.size() == 2 * (frames + 1) + 1);
    for (std::size_t i = 0; i < frames; ++i) check_same_match(both.results[2 * i + 1], second.results[i]);
    CHECK(both.exit_code == 0);
  }
}

using InferenceKey = std::pair<std::string, std::uint64_t>;  // component and frame

/// What `source` delivers up to this one.
std::map<InferenceKey, WireInference> inferences_until(ResultSource& source, const InferenceKey& last) {
  std::map<InferenceKey, WireInference> all;
  while (!all.contains(last)) {
    const auto message = source.receive(30s);
    REQUIRE(message);
    WireInference inference;
    REQUIRE(decode_inference(*message, inference) == WireStatus::ok);
    all[{inference.component, inference.frame_id}] = inference;
  }
  return all;
}

TEST_CASE("the inferred field of each component is published, from its own estimate's samples") {
  Bench bench;
  const std::string endpoint = "ipc://" + bench.file("inference");
  const auto server = bench.start(server_arguments(bench, {LBEA_MODEL, LBEA_OTHER_MODEL},
                                                   {"--method", "fit", "--min-coverage", "0.1", "--infer",
                                                    "plastic_strain", "--inference", endpoint}),
                                  "serve", "ready: frames on " + bench.frames());
  WireContext context;
  ResultSource source(context, bench.results()), inferred(context, endpoint);
  REQUIRE(source.receive(30s));
  Camera camera(context, bench.frames());
  camera.look_from(rail_pose);
  Served served;
  std::uint64_t first = 0;  // frame whose inferences come: earlier ones come before the subscription does
  while (true) {
    camera.send(first);
    std::size_t count = 0;
    receive(source, served, [&](const WireResult&) { return ++count == 2; });
    if (inferred.receive(1s)) break;
    REQUIRE(++first < 30);
  }
  served.results.clear();
  for (std::uint64_t id = first + 1; id < first + 5; ++id) camera.send(id);
  receive(source, served, [&](const WireResult&) { return served.results.size() == 8; });
  const auto inferences = inferences_until(inferred, {"other", first + 4});
  std::uint64_t sequence = inferences.at({"rail", first + 1}).sequence - 1;
  for (const WireResult& result : served.results) {
    CAPTURE(result.frame_id);
    const lbea::Model model = lbea::Model::open(result.component == "rail" ? LBEA_MODEL : LBEA_OTHER_MODEL);
    const WireInference& inference = inferences.at({result.component, result.frame_id});
    lbea::Inferred expected;
    lbea::infer_field(model, 0, result.fit.view(), expected);
    CHECK(inference.model_checksum == model.checksum());
    CHECK(inference.sequence == ++sequence);
    CHECK(inference.values == expected.mean);
    CHECK(inference.spread == expected.spread);
    CHECK(inference.bound_90 == expected.bound_90);
  }
  CHECK(stop(*server) == 0);
}

TEST_CASE("what does not work with several components is refused in a sentence that names it") {
  const std::string two = LBEA_MODEL " " LBEA_OTHER_MODEL;
  CHECK(contains(refusal(LBEA_MODEL " " LBEA_MODEL " --frames ipc://a"), "is also named rail"));
  CHECK(contains(refusal(two + " --frames a=ipc://a --frames b=ipc://b"), "several --frames takes one model"));
  CHECK(contains(refusal(two + " --frames ipc://a --matchers 2"), "on a thread per component; omit it"));
}
