#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine.hpp"
#include "soak_scenario.hpp"

namespace berth::cli {

/// Every backend that opens on this machine, opened once: drivers are not made to be opened thousands of times.
class SoakBackends {
 public:
  SoakBackends();

  const std::vector<std::string>& names() const { return names_; }
  Backend& at(const std::string& name) const { return *backends_.at(name); }
  /// What the scenario's engine runs on, with the faults that it has. They use those of this object.
  EngineBackends lend(const SoakScenario& scenario) const;

 private:
  std::vector<std::string> names_;
  std::map<std::string, std::unique_ptr<Backend>> backends_;
};

}  // namespace berth::cli
