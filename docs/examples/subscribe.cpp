// subscribe.cpp - print the results of a running lbea-serve until the test ends or nothing arrives for 10 s.
//   c++ -std=c++20 subscribe.cpp $(pkg-config --cflags --libs lbea-wire) -o subscribe
//   ./subscribe ipc:///tmp/results
#include <lbea/wire/client.hpp>

#include <iostream>

using namespace std::chrono_literals;
using lbea::wire::WireResult, lbea::wire::WireStatus;

int main(int argc, char** argv) try {
  lbea::wire::WireContext context;
  lbea::wire::ResultReceiver results(context, argc > 1 ? argv[1] : "ipc:///tmp/results");
  while (const WireResult* result = results.receive(10s)) {
    if (result->status == WireStatus::end_of_stream) break;
    std::cout << result->frame_id << ' ' << to_string(result->status) << ' ' << to_string(result->test.verdict);
    if (!result->matches.empty())
      std::cout << ' ' << result->matches.front().simulation_name << ' ' << result->matches.front().time_s << " s";
    std::cout << std::endl;
  }
  if (results.state() == nullptr) throw std::runtime_error("no results at this endpoint; start lbea-serve");
  std::cerr << "lost " << results.lost() << '\n';
  return results.lost() == 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
