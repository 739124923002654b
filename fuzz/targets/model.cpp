#include <flyball/study/analyze.hpp>

#include "targets/require.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flyball;
  const auto model = study::parse_model(fuzz::text_of(data, size), "fuzz.json");
  if (model) {
    fuzz::require(model->system.A.allFinite() && model->system.B.allFinite() &&
                      model->system.C.allFinite() && model->system.D.allFinite(),
                  "matrices are finite");
    if (model->system.A.rows() <= 10) {
      (void)study::analyze(*model);
    }
  }
  return 0;
}
