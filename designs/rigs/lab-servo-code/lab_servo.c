/*
 * lab_servo: see lab_servo.h.
 */
#include "lab_servo.h"

#define MOST_READING 1e+30
#define LIMIT 6.0 /* 6 of the command's unit */
#define MOST_MISSED 3u
#define MOST_STILL 32u

/* False of what is no number, too. */
static int is_reading(lab_servo_number value)
{
    return (value >= -MOST_READING) && (value <= MOST_READING);
}

void lab_servo_init(lab_servo_controller *c, lab_servo_number angle)
{
    int k;
    c->x[0] = (0.0018211647544176094 * angle);
    c->x[1] = (0.21506231297024581 * angle);
    c->x[2] = (1.0203211087283113 * angle);
    c->x[3] = (-4.6005206807944425 * angle);
    c->x[4] = (2.0046797876907561 * angle);
    c->x[5] = (7.8351704736720471 * angle);
    c->x[6] = (-0.073942286344920144 * angle);
    c->x[7] = (-0.090549351074088125 * angle);
    c->held[0] = (1.0 * angle);
    c->held[1] = angle;
    c->held[2] = 0.0;
    for (k = 0; k < LAB_SERVO_SENSORS; ++k) {
        c->still[k] = 0u;
    }
    c->missed = 0u;
    c->fault = 0u;
    c->full = 0u;
}

void lab_servo_reset(lab_servo_controller *c)
{
    lab_servo_init(c, 0.0);
}

/* Hold what is a reading; count what is none, and what stands still. */
static void take(lab_servo_controller *c, const lab_servo_number in[LAB_SERVO_SENSORS + 2])
{
    int missing = 0;
    int k;
    for (k = 0; k < (LAB_SERVO_SENSORS + 2); ++k) {
        if (is_reading(in[k])) {
            if (k < LAB_SERVO_SENSORS) {
                const int same = (c->full != 0u) && (in[k] >= c->held[k])
                    && (in[k] <= c->held[k]);
                c->still[k] = (same != 0) ? (c->still[k] + 1u) : 0u;
                if (c->still[k] >= MOST_STILL) {
                    c->fault |= LAB_SERVO_FAULT_STUCK;
                }
            }
            c->held[k] = in[k];
        } else {
            missing = 1;
        }
    }
    c->missed = (missing != 0) ? (c->missed + 1u) : 0u;
    if (c->missed > MOST_MISSED) {
        c->fault |= LAB_SERVO_FAULT_READING;
    }
}

/* The law itself: command and next states of what is held. */
static lab_servo_number answer(lab_servo_controller *c)
{
    const lab_servo_number *const x = c->x;
    const lab_servo_number *const y = c->held;
    const lab_servo_number angle = c->held[1];
    lab_servo_number command;
    double added[LAB_SERVO_STATES];
    double cut;
    double wanted;
    int k;

    wanted = (7.1880231378163018e-08 * x[0]) + (-0.00022517138244415591 * x[1])
        + (1.4239924350166453 * x[2]) + (-0.17508079578339264 * x[3])
        + (2.718161395356681 * x[4]) + (-4.9607672825192646 * x[5])
        + (-1.3070561229624369 * x[6]) + (-2.0082213549485459 * x[7])
        + (-26.837248998311342 * y[0]) + (57.719829333314145 * angle)
        + c->held[2];
    if (!is_reading(wanted)) {
        c->fault |= LAB_SERVO_FAULT_NUMBER;
        return 0.0;
    }
    if (wanted > LIMIT) {
        command = LIMIT;
    } else if (wanted < -LIMIT) {
        command = -LIMIT;
    } else {
        command = wanted;
    }
    cut = command - wanted;

    /* 8 states whose poles lie together */
    added[0] = (-1.0000478719762085 * x[0]) + (0.14996333887229502 * x[1])
        + (0.035093388004144167 * x[2]) + (0.025473502518132185 * x[3])
        + (0.0955381014633854 * x[4]) + (0.083398428613105841 * x[5])
        + (0.012062481872654048 * x[6]) + (0.068373528137595146 * x[7])
        + (-0.78557229036736609 * y[0]) + (-0.0013541699104500247 * angle)
        + (-2.3461086529378394e-05 * cut);
    added[1] = (-0.99999999999974443 * x[1]) + (0.12652241144641438 * x[2])
        + (0.28576770672190921 * x[3]) + (1.3690646430758053 * x[4])
        + (-0.073697669840866037 * x[5]) + (-0.042330111848180786 * x[6])
        + (0.10524064022003597 * x[7]) + (-5.0021148106173854 * y[0])
        + (4.2420609562656528 * angle) + (0.073493996868373684 * cut);
    added[2] = (-0.020242118454822267 * x[2]) + (-0.18127348609161659 * x[3])
        + (0.074625743330487604 * x[4]) + (-0.13213886362791871 * x[5])
        + (-0.051278824054479956 * x[6]) + (-0.068822657543789523 * x[7])
        + (-0.84320626529539344 * y[0]) + (0.90561358735061004 * angle)
        + (0.015689817482324345 * cut);
    added[3] = (0.11349036471393348 * x[2]) + (-0.020242118454822267 * x[3])
        + (-0.15042443233474234 * x[4]) + (0.056738093515308008 * x[5])
        + (0.055950052795817849 * x[6]) + (0.067686367395737593 * x[7])
        + (0.88920689156291155 * y[0]) + (-1.2308615753904975 * angle)
        + (-0.021324761171462463 * cut);
    added[4] = (-0.36711345357470093 * x[4]) + (0.76211539466688583 * x[5])
        + (0.18479557605955588 * x[6]) + (0.39268801305093248 * x[7])
        + (0.42368602736712369 * y[0]) + (-5.6098232928648759 * angle)
        + (-0.097190573112575979 * cut);
    added[5] = (-0.12183215187445399 * x[4]) + (-0.36711345357470093 * x[5])
        + (0.062397885961049157 * x[6]) + (-0.066612133444804184 * x[7])
        + (2.6395056981904883 * y[0]) + (0.47970740299333137 * angle)
        + (0.008310963641683166 * cut);
    added[6] = (-0.33205689455006993 * x[6]) + (-0.558584746216371 * x[7])
        + (-0.041332318990431001 * y[0]) + (-0.033800213278969565 * angle)
        + (-0.00058559101212485927 * cut);
    added[7] = (0.93279659470595477 * x[6]) + (-0.33205689455006993 * x[7])
        + (-0.11697565554422265 * y[0]) + (0.15588123213034794 * angle)
        + (0.002700653032603095 * cut);

    for (k = 0; k < LAB_SERVO_STATES; ++k) {
        c->x[k] = c->x[k] + added[k];
    }
    return command;
}

lab_servo_number lab_servo_step(lab_servo_controller *c,
    const lab_servo_number y[LAB_SERVO_SENSORS], lab_servo_number angle,
    lab_servo_number feedforward)
{
    lab_servo_number in[LAB_SERVO_SENSORS + 2];
    lab_servo_number command = 0.0;
    int k;
    for (k = 0; k < LAB_SERVO_SENSORS; ++k) {
        in[k] = y[k];
    }
    in[1] = angle;
    in[2] = feedforward;
    if (c->fault == 0u) {
        take(c, in);
    }
    if (c->fault == 0u) {
        command = answer(c);
    }
    c->full = ((command >= LIMIT) || (command <= -LIMIT)) ? 1u : 0u;
    return command;
}

lab_servo_number lab_servo_theta_of_counts(int32_t counts)
{
    return 0.0015339807878856412 * (double)counts; /* rad */
}

int32_t lab_servo_steps_of_command(lab_servo_number command)
{
    double steps = 204.69999999999999 * command;
    steps = (steps >= 0.0) ? (steps + 0.5) : (steps - 0.5);
    if (steps > 2147483520.0) {
        steps = 2147483520.0;
    } else if (steps < -2147483520.0) {
        steps = -2147483520.0;
    } else {
        /* within the converter's range */
    }
    return (int32_t)steps;
}
