// A diagnosis in one line and one action.
#pragma once

#include <string>

#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/result/diagnosis.h"

namespace gapfarm {

// "Two cameras disagree at y = 1.34 m; something more is unexplained.": the likeliest cause in
// plain language, about a line long; of a log with a data-quality warning, what is wrong with it.
std::string headline(const Diagnosis& diagnosis,
                     const EffectDiagnoses& effects = drive_effect_diagnoses());

// "Trim the faster side's duty by 4.8 %, or paste the parameters below into your config.": the one
// thing to do next.  Once next experiments are known.
std::string action(const Diagnosis& diagnosis,
                   const EffectDiagnoses& effects = drive_effect_diagnoses());

void fill_conclusions(const EffectDiagnoses& effects, Diagnosis* diagnosis);

// That an effect that gained `gain` nats beyond luck, where `least_gain` names one, is there, or
// one of its aliases: grows with the gain, and stays below 1 by what the counts leave open.
double confidence_of(double gain, double least_gain);

// The same of what the sanity stage names.
double sanity_confidence();

}  // namespace gapfarm
