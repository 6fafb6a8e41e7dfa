/*
 * lab_servo: the controller of a slewing arm.
 *
 * Design lab-servo (sha256:4e6c2752eb96e1a85f375389c0588eace0722557a4b32fd0930c54667b5f7967),
 *   slewctl 0.2.0.
 * Method lqg, 8 states, every 0.005 s, 0 s late.
 * On the truth of 20 modes: gain margin 7.999 dB, phase margin 42.5 deg, delay margin 0.01659
 *   s, modulus margin 0.5044, disk margin 0.6303.
 * double precision
 * the command is cut off at 6 V, after which the states settle with a time constant of 0.424 s
 *
 * y[0]  theta, in rad
 * angle  reference of the hub's angle, in rad
 * feedforward  added to the command, in V: that of the time when it acts; zero without one
 * returns  the voltage, in V; it acts with a plus sign
 *
 * Every 0.005 s; the command is due 0 s after the readings.
 * A reading that is not a number, infinite or beyond 1e30 is replaced by the last good one,
 *   for at most 3 samples in a row (what the delay margin forgives); then the command is zero
 *   and fault says so.
 * A reading that does not change at all for 32 samples of full command is stuck: the command
 *   is zero and fault says so.
 * After a fault, init or reset starts it again.
 * Compile it without -ffast-math, which takes away what is no number.
 */
#ifndef LAB_SERVO_H
#define LAB_SERVO_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LAB_SERVO_STATES 8
#define LAB_SERVO_SENSORS 1
#define LAB_SERVO_SAMPLE_TIME_S 0.005

/* Why it commands nothing any more, until it is started again. */
#define LAB_SERVO_FAULT_READING 1u /* readings missing for longer than it bears */
#define LAB_SERVO_FAULT_STUCK 2u   /* a reading stands still at full command */
#define LAB_SERVO_FAULT_NUMBER 4u  /* the command is no number */

typedef double lab_servo_number;

typedef struct {
    lab_servo_number x[LAB_SERVO_STATES]; /* modal sections */
    lab_servo_number held[LAB_SERVO_SENSORS + 2]; /* last readings, reference angle, feedforward */
    uint32_t still[LAB_SERVO_SENSORS]; /* samples without a change at full command */
    uint32_t missed;   /* samples in a row with a reading missing */
    uint32_t fault;    /* zero, or why it commands nothing */
    uint32_t full;     /* whether the last command was at its limit */
} lab_servo_controller;

/* Start at rest at an angle, without a jump of the command. */
void lab_servo_init(lab_servo_controller *c, lab_servo_number angle);

/* Start at rest at angle zero. */
void lab_servo_reset(lab_servo_controller *c);

/* Return the command; call it once every sample. */
lab_servo_number lab_servo_step(lab_servo_controller *c,
    const lab_servo_number y[LAB_SERVO_SENSORS], lab_servo_number angle,
    lab_servo_number feedforward);

/* theta of an encoder's counts. */
lab_servo_number lab_servo_theta_of_counts(int32_t counts);

/* A converter's steps of the command. */
int32_t lab_servo_steps_of_command(lab_servo_number command);

#ifdef __cplusplus
}
#endif

#endif /* LAB_SERVO_H */
