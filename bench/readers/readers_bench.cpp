// How fast logs are read, beside the plainest loop over the same bytes: strtod for each number of a
// table, nlohmann's SAX parser for JSON. `bench_readers [ROWS]`: MB/s of processor time, the
// largest of nine turns that take each other's place.

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

#include <nlohmann/json.hpp>

#include <flyball/core/random.hpp>
#include <flyball/io/csv.hpp>
#include <flyball/io/sysid_json.hpp>

namespace {

/// Rows as a robot writes them: five decimals of time, three of volts, all digits of what it
/// computed.
std::string row(flyball::Random& random, int k, const char* format) {
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(), format, 0.005 * k, 12.0 * random.uniform() - 6.0,
                10.0 * random.uniform(), random.normal());
  return text.data();
}

std::string csv(int rows) {
  flyball::Random random(1);
  std::string text = "Timestamp (s),Voltage (V),Position (rad),Velocity (rad/s)\n";
  for (int k = 0; k < rows; ++k) {
    text += row(random, k, "%.3f,%.3f,%.17g,%.17g\n");
  }
  return text;
}

std::string sysid(int rows) {
  flyball::Random random(1);
  std::string text = R"({"sysid": true, "test": "Simple", "units": "Radians", )"
                     R"("unitsPerRotation": 6.283185307179586)";
  for (const char* test : {"slow-forward", "slow-backward", "fast-forward", "fast-backward"}) {
    text += std::string(", \"") + test + "\": [";
    for (int k = 0; k < rows / 4; ++k) {
      text += (k == 0 ? "" : ", ") + row(random, k, "[%.5f, %.3f, %.17g, %.17g]");
    }
    text += "]";
  }
  return text + "}";
}

double sum = 0.0;  // of everything that was read, so that nothing is left out

void strtod_loop(const std::string& text) {
  const char* at = text.c_str() + text.find('\n');
  while (*at != '\0') {
    char* end = nullptr;
    sum += std::strtod(at, &end);
    at = end == at ? at + 1 : end + (*end != '\0' ? 1 : 0);
  }
}

class Sum : public nlohmann::json_sax<nlohmann::json> {
 public:
  bool null() override { return true; }
  bool boolean(bool /*value*/) override { return true; }
  bool number_integer(number_integer_t value) override { return add(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) override { return add(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t& /*text*/) override { return add(value); }
  bool string(string_t& /*value*/) override { return true; }
  bool binary(binary_t& /*value*/) override { return true; }
  bool start_object(std::size_t /*size*/) override { return true; }
  bool key(string_t& /*name*/) override { return true; }
  bool end_object() override { return true; }
  bool start_array(std::size_t /*size*/) override { return true; }
  bool end_array() override { return true; }
  bool parse_error(std::size_t /*at*/, const std::string& /*token*/,
                   const nlohmann::detail::exception& /*error*/) override {
    return false;
  }

 private:
  static bool add(double value) {
    sum += value;
    return true;
  }
};

template <class Work>
double rate(const std::string& text, Work&& work) {
  const std::clock_t start = std::clock();
  work();
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  return static_cast<double>(text.size()) / 1e6 / seconds;
}

template <class Ours, class Peer>
void compare(const char* what, const std::string& text, Ours&& ours, const char* peer_name,
             Peer&& peer) {
  double mine = 0.0;
  double theirs = 0.0;
  for (int turn = 0; turn < 9; ++turn) {
    mine = std::max(mine, rate(text, ours));
    theirs = std::max(theirs, rate(text, peer));
  }
  std::printf("%-12s %6.1f MB: %6.0f MB/s, %s %6.0f, ratio %.2f\n", what,
              static_cast<double>(text.size()) / 1e6, mine, peer_name, theirs, mine / theirs);
}

}  // namespace

int main(int argc, char** argv) {
  const int rows = argc > 1 ? std::atoi(argv[1]) : 200000;
  const std::string table = csv(rows);
  compare(
      "CSV", table,
      [&] {
        const auto log = flyball::parse_csv(table, "bench");
        sum += log ? log->signals.front().value.back() : std::nan("");
      },
      "a loop of strtod", [&] { strtod_loop(table); });
  const std::string json = sysid(rows);
  compare(
      "SysId JSON", json,
      [&] {
        const auto log = flyball::parse_sysid_json(json, "bench");
        sum += log ? log->runs.front().voltage.back() : std::nan("");
      },
      "nlohmann's SAX parser",
      [&] {
        Sum handler;
        nlohmann::json::sax_parse(json, &handler);
      });
  return sum == sum ? 0 : 1;
}
