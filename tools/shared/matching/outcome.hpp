// What the matcher found, on its way to becoming a result. Nothing here allocates once there is room.
#pragma once

#include "adapters/wire/codec/messages.hpp"
#include "tools/shared/matching/match_engine.hpp"

namespace lbea::tool {

struct Outcome {
  wire::WireResult result;     // without matches
  std::vector<Match> matches;  // whoever composes the result names them
  wire::WireFit fit;           // room for what the engine can find
  wire::WireTestState test;
};

/// Makes the room.
void reserve(Outcome& outcome, std::uint32_t max_matches);
/// As new, with its room.
void clear(Outcome& outcome) noexcept;
/// Takes in what the matcher found in one frame; `test` may be null.
void fill_outcome(Outcome& outcome, const MatchResult& match, const TestState* test) noexcept;
/// The result with the names of its matches.
void compose(const Outcome& outcome, const MatchEngine& engine, wire::WireResult& into);
/// Where the matcher gave no verdict, the status decides.
void complete_verdict(wire::WireResult& result) noexcept;

}  // namespace lbea::tool
