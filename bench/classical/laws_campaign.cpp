// The laws of tests/classical/laws.hpp on as many systems as are asked for: laws_campaign [COUNT]
// [SEED]. It ends with 1 if one does not hold.
#include <cstdio>
#include <cstdlib>

#include "classical/laws.hpp"

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 1000;
  const auto seed = static_cast<std::uint64_t>(argc > 2 ? std::atoi(argv[2]) : 1);
  int violations = 0;
  std::printf("%-46s %8s %8s %10s %10s\n", "law", "systems", "refused", "violations", "worst");
  for (const flyball::test::Law& holds : flyball::test::all_laws) {
    const flyball::test::LawTally law = holds(seed, count);
    std::printf("%-46s %8d %8d %10d %10.1e\n", law.law.c_str(), law.systems, law.refused,
                law.violations, law.worst);
    std::fflush(stdout);
    violations += law.violations;
  }
  return violations == 0 ? 0 : 1;
}
