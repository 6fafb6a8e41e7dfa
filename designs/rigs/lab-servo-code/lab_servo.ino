/*
 * Runs lab_servo every 5000 us. Fill in what is marked: how the sensors are read and the
 *   voltage is put out.
 * lab_servo.h and lab_servo.c stand beside this file.
 */
#include "lab_servo.h"

static lab_servo_controller controller;
static uint32_t due;

/* TO DO: theta, in counts. */
static int32_t read_theta(void)
{
    return 0;
}

/* TO DO: put out the voltage, in converter steps. */
static void put_out(int32_t value)
{
    (void)value;
}

/* TO DO: where the arm is to go. */
static lab_servo_number reference_angle(void)
{
    return 0;
}

void setup()
{
    lab_servo_init(&controller, lab_servo_theta_of_counts(read_theta()));
    due = micros();
}

void loop()
{
    if ((int32_t)(micros() - due) >= 0) {
        lab_servo_number y[LAB_SERVO_SENSORS];
        lab_servo_number command;
        due += 5000UL;
        y[0] = lab_servo_theta_of_counts(read_theta());
        command = lab_servo_step(&controller, y, reference_angle(), 0);
        put_out(lab_servo_steps_of_command(command));
    }
}
