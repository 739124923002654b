// What is proven for every mechanism of a set, in words, as a table and as JSON.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include <fmt/format.h>

#include "core/wording.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using text::number;
using text::percent;
using text::seconds;

constexpr double radian = std::numbers::pi / 180.0;

bool proven(const PlantProof& proof) {
  return proof.tried && proof.certificate.verdict == LoopVerdict::stable;
}

bool broken(const PlantProof& proof) {
  return proof.tried && proof.certificate.verdict == LoopVerdict::unstable;
}

/// "kV 4 V·s/m, kA 0.36 V·s²/m, gain × 1.2, delay 10 ms"
std::string member_text(const DesignResult& result, const LoopMember& member) {
  const std::string& unit = result.job.plant.unit;
  const auto& p = member.parameters;
  return fmt::format("kV {} V·s/{}, kA {} V·s²/{}, gain × {}, delay {}", number(p(0), 4), unit,
                     number(p(1), 3), unit, number(p(2), 3), seconds(p(3)));
}

Value verdict_value(const DesignResult& result, const PlantProof& proof) {
  const LoopCertificate& certificate = proof.certificate;
  if (!proof.tried) {
    return {fmt::format("no proof was tried: {} states are too many", proof.states), Tone::caution};
  }
  switch (certificate.verdict) {
    case LoopVerdict::stable:
      return {"stable for every one, proven", Tone::good};
    case LoopVerdict::unstable:
      return {fmt::format("unstable with {}", member_text(result, certificate.worst)), Tone::bad};
    case LoopVerdict::undecided:
      break;
  }
  return {fmt::format("neither proven nor broken in {} of the set",
                      percent(certificate.undecided_share, 2)),
          Tone::caution};
}

}  // namespace

bool all_proven(const DesignResult& result) {
  return !result.proofs.empty() && std::all_of(result.proofs.begin(), result.proofs.end(), proven);
}

std::string proof_line(const DesignResult& result) {
  if (!all_proven(result)) {
    return "The loop is stable, and so is every point of a grid of errors.";
  }
  std::string sets;
  for (std::size_t i = 0; i < result.proofs.size(); ++i) {
    sets += fmt::format("{}{}",
                        i == 0                          ? ""
                        : i + 1 == result.proofs.size() ? ", and with "
                                                        : ", with ",
                        result.proofs[i].set);
  }
  return fmt::format("The loop is proven stable for every mechanism with {}.", sets);
}

void add_proofs(Verdict& verdict, const DesignResult& result) {
  for (const PlantProof& proof : result.proofs) {
    if (broken(proof)) {
      verdict.add(Tone::bad,
                  fmt::format("among the mechanisms with {} is one whose loop is unstable: {}",
                              proof.set, member_text(result, proof.certificate.worst)));
    } else if (proof.tried && !proven(proof)) {
      verdict.add(Tone::caution,
                  fmt::format("for mechanisms with {} stability was not proven everywhere, and no "
                              "unstable one was found",
                              proof.set));
    }
  }
}

std::vector<Block> proof_blocks(const DesignResult& result) {
  std::vector<Block> blocks;
  if (result.proofs.empty()) {
    return blocks;
  }
  Table table;
  table.caption = "What holds for every mechanism of a set, with its observer and delay:";
  table.header = {"every mechanism with", "its loop is", "gain", "phase margin", "disk margin"};
  table.words = {0, 1, 2, 3, 4};
  std::vector<Block> worst;
  for (const PlantProof& proof : result.proofs) {
    const LoopCertificate& certificate = proof.certificate;
    const bool margins = proven(proof) && certificate.disk_margin > 0.0;
    table.rows.push_back(
        {proof.set, verdict_value(result, proof),
         margins ? fmt::format("may fall to {} × and rise to {} ×",
                               number(certificate.gain_down, 3), number(certificate.gain_up, 3))
                 : "",
         margins ? fmt::format("at least {}°", number(certificate.phase_margin, 3)) : "",
         margins ? fmt::format("at least {}", number(certificate.disk_margin, 3)) : ""});
    if (proof.tried && certificate.worst.parameters.size() == 4) {
      worst.emplace_back(Paragraph{fmt::format("The worst found with {}: disk margin {} with {}.",
                                               proof.set, number(certificate.worst.disk_margin, 3),
                                               member_text(result, certificate.worst)),
                                   Tone::quiet});
    }
  }
  blocks.emplace_back(std::move(table));
  std::move(worst.begin(), worst.end(), std::back_inserter(blocks));
  blocks.emplace_back(Paragraph{
      fmt::format(
          "A set is proven by a Lyapunov function for each of the pieces that it is cut into, "
          "every rounding counted: it holds between the points of any grid too. The margins "
          "are of the disk, so that gain and phase may change at once.{}",
          result.job.plant.kind == mechanisms::MechanismKind::arm
              ? " It is of the linear model: how gravity changes with the angle is fed "
                "forward and not in it."
              : ""),
      Tone::quiet});
  return blocks;
}

void write_proofs(JsonWriter& json, const DesignResult& result) {
  json.list("proofs", result.proofs, [&](const PlantProof& proof) {
    const LoopCertificate& certificate = proof.certificate;
    json.object([&] {
      json.add("of", proof.of);
      json.add("set", proof.set);
      json.add("verdict", proof.tried ? to_string(certificate.verdict) : "not_tried");
      json.add({{"disk_margin", certificate.disk_margin},
                {"gain_reduction", certificate.gain_down},
                {"gain_margin", certificate.gain_up},
                {"phase_margin", certificate.phase_margin * radian},
                {"decay", certificate.decay},
                {"undecided_share", certificate.undecided_share}});
      json.add("pieces", certificate.pieces);
      const LoopMember& worst = certificate.worst;
      if (worst.parameters.size() == 4) {
        json.add("worst", {{"kV", worst.parameters(0)},
                           {"kA", worst.parameters(1)},
                           {"gain", worst.parameters(2)},
                           {"delay", worst.parameters(3)},
                           {"spectral_radius", worst.spectral_radius},
                           {"disk_margin", worst.disk_margin}});
      } else {
        json.add("worst", std::optional<double>());
      }
    });
  });
}

}  // namespace flyball::study
