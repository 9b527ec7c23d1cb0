! SPDX-License-Identifier: MIT
!> Strength of joints: Mohr-Coulomb and further laws beside it.
!>
!> Source: Shi's Mohr-Coulomb contact (thesis 3.3). A contact resists slip up to mu N + c l: N the compression,
!> l the contact length, c the cohesion; it resists opening up to t l, t the tensile strength. In tension (N < 0) a bond
!> resists c l + mu N, not less than 0: the same straight line, cut off at N = -t l.
!>
!> The laws differ in the friction coefficient mu, phi the friction angle of the material:
!>
!>     coulomb        mu = tan(phi)
!>     velocity       mu = mu_d + (tan(phi) - mu_d) exp(-|v|/v_c): Stribeck's form of rate dependence; mu_d of
!>                    residual_friction, v_c = slip_rate
!>     displacement   mu = tan(phi) - (tan(phi) - mu_r) min(|s|/s_c, 1): linear slip weakening (Ida 1972); mu_r of
!>                    residual_friction, s_c = slip_length
!>     residual       the same for mu, c and t: each falls linearly with slip to its residual value. What was never
!>                    bonded, or has opened, has the residual values
!>     barton_bandis  mu = tan(min(JRC max(log10(JCS/sigma), 0) + phi_r, 70 deg)), sigma = N/l
!>                    (Barton and Choubey 1977): the peak strength of rough joints
!>
!> brittle: c and t are lost at the first slip or opening. Otherwise they stay, unless law residual weakens them.
!>
!> reduction: mu, c and t are divided by its three numbers (strength reduction, rockdda_run_factor_search).
!>
!> What a new law takes is listed in docs/architecture.md (A contact law).
module rockdda_interaction_joint_strength
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_contact_normal_law, only : normal_law_type, new_normal_law
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_options, only : is_set
   implicit none
   private
   public :: joint_law_type, strength_law, new_joint_laws, act_along_length, friction_coefficient, shear_strength, &
      is_friction_alone, cohesion_at, tension_at, dilated_gap, opened_last

   type :: strength_law_enum
      integer :: coulomb = 1
      integer :: velocity = 2
      integer :: displacement = 3
      integer :: residual = 4
      integer :: barton_bandis = 5
   end type strength_law_enum
   type(strength_law_enum), parameter :: strength_law = strength_law_enum()

   !> Largest angle of barton_bandis [deg]: towards no normal stress the formula grows without bound.
   real(wp), parameter :: steepest = 70

   !> The law of one joint material.
   type :: joint_law_type
      integer :: law = 1                !! one of strength_law%...
      real(wp) :: friction = 0          !! tan of the friction angle at rest and before slip; barton_bandis: its bound
      real(wp) :: cohesion = 0          !! [force/length^2], >= 0
      real(wp) :: tension = 0           !! tensile strength [force/length^2], >= 0
      real(wp) :: final_friction = 0    !! mu_d or mu_r; coulomb: not used
      real(wp) :: residual_cohesion = 0 !! of contacts without a bond, and with law residual after slip
      real(wp) :: residual_tension = 0  !! the same
      real(wp) :: scale = 1             !! v_c [length/time] or s_c [length], > 0; coulomb: not used
      real(wp) :: jrc = 0               !! [deg]
      real(wp) :: jcs = 1               !! [force/length^2], > 0
      real(wp) :: base_angle = 0        !! phi_r of barton_bandis [deg]
      real(wp) :: dilation = 0          !! tan of the dilation angle
      real(wp) :: dilation_slip = huge(1.0_wp)  !! slip at which dilation ends [length]
      real(wp) :: damping_ratio = 0     !! Voigt dashpot, fraction of critical, >= 0
      real(wp) :: sliding_damping = 0   !! the same while it slides, in the attempt at hand
      real(wp) :: restitution = -1      !! in [0, 1]; < 0: no law of impact
      real(wp) :: reduction = 1         !! by which friction has been divided
      logical :: brittle = .true.       !! slip breaks the bond
      type(normal_law_type) :: normal   !! along the normal
   end type joint_law_type

contains

   !> The laws of all joint materials. Faults of their parameters are errors, each where options of the material were
   !> read.
   subroutine new_joint_laws(materials, laws, messages)
      type(joint_material_type), intent(in) :: materials(:)              !! all joint materials
      type(joint_law_type), allocatable, intent(out) :: laws(:)        !! one per joint material
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: fault
      integer :: i
      allocate (laws(size(materials)))
      do i = 1, size(materials)
         laws(i)%friction = tan(materials(i)%friction_angle*pi/180)
      end do
      do i = 1, size(materials)
         laws(i)%cohesion = materials(i)%cohesion
         laws(i)%tension = materials(i)%tension
         laws(i)%damping_ratio = materials(i)%damping_ratio
         laws(i)%brittle = materials(i)%brittle
         if (is_set(materials(i)%restitution)) laws(i)%restitution = materials(i)%restitution
         if (.not. materials(i)%brittle) then
            laws(i)%residual_cohesion = materials(i)%cohesion
            laws(i)%residual_tension = materials(i)%tension
         end if
         call set_law(materials(i), laws(i), fault)
         if (len(fault) == 0) fault = unused_parameter(materials(i), laws(i)%law)
         if (len(fault) == 0) call set_dilation(materials(i), laws(i), fault)
         if (len(fault) == 0) fault = closure_fault(materials(i))
         if (materials(i)%damping_ratio < 0) fault = 'the damping ratio must not be negative'
         if (.not. all(materials(i)%reduction > 0)) fault = 'the reduction of the strength must be positive'
         if (len(fault) == 0) call reduce_strength(materials(i)%reduction, laws(i))
         if (len(fault) > 0) call messages%add(severity%error, 'law of joint material '//to_string(i)//': '//fault, &
                                               materials(i)%origin)
      end do
   end subroutine new_joint_laws

   !> What the law of a joint has with contact by length alone. A joint with a coefficient of restitution e whose
   !> contacts last longer than a step rebounds as a dashpot has it,
   !>
   !>     zeta = -ln e/sqrt(pi^2 + ln^2 e)
   !>
   !> of critical damping, e = 0: critical. Without it blocks that no impact may throw back would bounce on their
   !> springs.
   elemental subroutine act_along_length(material, law)
      type(joint_material_type), intent(in) :: material
      type(joint_law_type), intent(inout) :: law
      law%normal = new_normal_law(material, .true.)
      if (law%restitution < 0 .or. law%damping_ratio > 0) return
      law%damping_ratio = 1
      if (law%restitution > 0) law%damping_ratio = -log(law%restitution)/hypot(pi, log(law%restitution))
   end subroutine act_along_length

   !> Divide friction coefficients, cohesion and tension by a factor each. The angles of barton_bandis stay: its
   !> coefficient is divided where it is computed.
   pure subroutine reduce_strength(factor, law)
      real(wp), intent(in) :: factor(3)   !! of friction, cohesion, tension, > 0
      type(joint_law_type), intent(inout) :: law
      law%reduction = factor(1)
      law%friction = law%friction/factor(1)
      law%final_friction = law%final_friction/factor(1)
      law%cohesion = law%cohesion/factor(2)
      law%tension = law%tension/factor(3)
      law%residual_cohesion = law%residual_cohesion/factor(2)
      law%residual_tension = law%residual_tension/factor(3)
   end subroutine reduce_strength

   !> Kind and parameters of a law.
   pure subroutine set_law(material, law, fault)
      type(joint_material_type), intent(in) :: material
      type(joint_law_type), intent(inout) :: law
      character(len=:), allocatable, intent(out) :: fault    !! empty: none
      character(len=:), allocatable :: name
      integer :: n
      name = 'coulomb'
      if (allocated(material%law)) then
         if (len_trim(material%law) > 0) name = trim(material%law)
      end if
      fault = ''
      n = 0
      if (allocated(material%parameters)) n = size(material%parameters)
      select case (name)
      case ('coulomb')
         law%law = strength_law%coulomb
         if (n > 0) fault = 'coulomb takes no parameters'
      case ('velocity')
         law%law = strength_law%velocity
         call set_weakening(material, material%slip_rate, 'velocity', 'friction angle at high rates [deg], rate', &
                            'residual_friction and slip_rate', law, fault)
      case ('displacement')
         law%law = strength_law%displacement
         call set_weakening(material, material%slip_length, 'displacement', 'residual friction angle [deg], slip', &
                            'residual_friction and slip_length', law, fault)
      case ('residual')
         if (n > 0) fault = 'residual takes its parameters by name'
         if (n == 0) call set_residual(material, law, fault)
      case ('barton_bandis')
         if (n > 0) fault = 'barton_bandis takes its parameters by name'
         if (n == 0) call set_barton_bandis(material, law, fault)
      case default
         fault = "unknown law '"//name//"', expected coulomb, velocity, displacement, residual or barton_bandis"
      end select
   end subroutine set_law

   !> A friction angle that weakens, and the scale at which it does: by order, or by name.
   pure subroutine set_weakening(material, named_scale, name, order, names, law, fault)
      type(joint_material_type), intent(in) :: material
      real(wp), intent(in) :: named_scale
      character(len=*), intent(in) :: name, order, names     !! of the law and of its parameters
      type(joint_law_type), intent(inout) :: law
      character(len=:), allocatable, intent(inout) :: fault
      real(wp) :: angle, scale
      integer :: n
      n = 0
      if (allocated(material%parameters)) n = size(material%parameters)
      angle = material%residual_friction
      scale = named_scale
      if (n > 0 .and. (is_set(angle) .or. is_set(scale))) then
         fault = name//': give its parameters in order or by name, not both'
      else if (n == 2) then
         angle = material%parameters(1)
         scale = material%parameters(2)
      else if (n > 0 .or. .not. (is_set(angle) .or. is_set(scale))) then
         fault = name//' takes 2 parameters: '//order
      else if (.not. (is_set(angle) .and. is_set(scale))) then
         fault = name//' needs '//names
      end if
      if (len(fault) > 0) return
      if (.not. (angle >= 0 .and. angle < 90)) then
         fault = 'the friction angle must be in [0, 90)'
      else if (.not. scale > 0) then
         fault = 'the second parameter must be positive'
      else
         law%final_friction = tan(angle*pi/180)
         law%scale = scale
      end if
   end subroutine set_weakening

   !> Residual friction, cohesion and tension, and the slip at which they are reached. Without cohesion and tension of
   !> their own they are 0, without friction of its own it stays.
   pure subroutine set_residual(material, law, fault)
      type(joint_material_type), intent(in) :: material
      type(joint_law_type), intent(inout) :: law
      character(len=:), allocatable, intent(inout) :: fault
      law%law = strength_law%residual
      law%brittle = .false.
      law%final_friction = law%friction
      ! equal angles make equal tangents, with any procedures of the compiler
      if (material%residual_friction < material%friction_angle .and. is_set(material%residual_friction)) &
         law%final_friction = tan(material%residual_friction*pi/180)
      law%residual_cohesion = 0
      if (is_set(material%residual_cohesion)) law%residual_cohesion = material%residual_cohesion
      law%residual_tension = 0
      if (is_set(material%residual_tension)) law%residual_tension = material%residual_tension
      if (is_set(material%slip_length)) law%scale = material%slip_length
      if (material%brittle_given .and. material%brittle) then
         fault = 'law residual says how strength is lost: brittle = .true. contradicts it'
      else if (material%residual_friction > material%friction_angle .or. law%residual_cohesion > law%cohesion .or. &
               law%residual_tension > law%tension) then
         fault = 'residual strength must not be larger than the peak'
      else if (law%residual_tension > 0 .and. .not. law%residual_cohesion > 0) then
         fault = 'residual tension needs residual cohesion: in tension the least shear breaks a bond without it'
      else if (.not. is_set(material%slip_length) .and. (law%final_friction < law%friction .or. &
               law%residual_cohesion < law%cohesion .or. law%residual_tension < law%tension)) then
         fault = 'residual needs slip_length, the slip from peak to residual strength'
      else if (.not. law%scale > 0) then
         fault = 'slip_length must be positive'
      end if
   end subroutine set_residual

   !> JRC, JCS and the angle of flat surfaces.
   pure subroutine set_barton_bandis(material, law, fault)
      type(joint_material_type), intent(in) :: material
      type(joint_law_type), intent(inout) :: law
      character(len=:), allocatable, intent(inout) :: fault
      law%law = strength_law%barton_bandis
      if (.not. (is_set(material%jrc) .and. is_set(material%jcs) .and. is_set(material%residual_friction))) then
         fault = 'barton_bandis needs jrc, jcs and residual_friction'
      else if (.not. (material%jrc >= 0 .and. material%jcs > 0 .and. material%residual_friction >= 0 .and. &
                      material%residual_friction <= steepest)) then
         fault = 'jrc must not be negative, jcs must be positive, and residual_friction must be in [0, 70]'
      else
         law%jrc = material%jrc
         law%jcs = material%jcs
         law%base_angle = material%residual_friction
         law%final_friction = tan(law%base_angle*pi/180)
         law%friction = tan(merge(steepest, law%base_angle, law%jrc > 0)*pi/180)
      end if
   end subroutine set_barton_bandis

   !> A parameter that the law does not have; empty: there is none.
   pure function unused_parameter(material, law) result(fault)
      type(joint_material_type), intent(in) :: material
      integer, intent(in) :: law
      character(len=:), allocatable :: fault
      logical :: weakens
      weakens = law == strength_law%displacement .or. law == strength_law%residual
      fault = ''
      if (is_set(material%residual_friction) .and. law == strength_law%coulomb) fault = name_of('residual_friction')
      if (is_set(material%residual_cohesion) .and. law /= strength_law%residual) fault = name_of('residual_cohesion')
      if (is_set(material%residual_tension) .and. law /= strength_law%residual) fault = name_of('residual_tension')
      if (is_set(material%slip_length) .and. .not. weakens) fault = name_of('slip_length')
      if (is_set(material%slip_rate) .and. law /= strength_law%velocity) fault = name_of('slip_rate')
      if (is_set(material%jrc) .and. law /= strength_law%barton_bandis) fault = name_of('jrc')
      if (is_set(material%jcs) .and. law /= strength_law%barton_bandis) fault = name_of('jcs')

   contains

      !> The message.
      pure function name_of(parameter) result(text)
         character(len=*), intent(in) :: parameter
         character(len=:), allocatable :: text
         text = parameter//' is given, but it is no parameter of this law'
      end function name_of

   end function unused_parameter

   !> What cannot be with a largest closure; empty: nothing.
   pure function closure_fault(material) result(fault)
      type(joint_material_type), intent(in) :: material
      character(len=:), allocatable :: fault
      fault = ''
      if (.not. is_set(material%maximum_closure)) return
      if (.not. material%normal_stiffness > 0) fault = 'maximum_closure needs normal_stiffness, that without stress'
      if (material%tie) fault = 'a tie has no closure: maximum_closure and tie = .true. exclude each other'
      if (is_set(material%restitution)) fault = 'maximum_closure and restitution exclude each other'
   end function closure_fault

   !> Dilation. Above the lowest friction angle the joint would give more work than it takes.
   pure subroutine set_dilation(material, law, fault)
      type(joint_material_type), intent(in) :: material
      type(joint_law_type), intent(inout) :: law
      character(len=:), allocatable, intent(inout) :: fault
      real(wp) :: lowest   !! [deg]
      law%dilation = tan(material%dilation*pi/180)
      if (is_set(material%dilation_slip)) law%dilation_slip = material%dilation_slip
      lowest = material%friction_angle
      if (law%law == strength_law%barton_bandis) lowest = law%base_angle
      if (law%law == strength_law%velocity .or. law%law == strength_law%displacement) &
         lowest = min(lowest, atan(law%final_friction)*180/pi)
      if (law%law == strength_law%residual .and. is_set(material%residual_friction)) lowest = material%residual_friction
      if (.not. (material%dilation >= 0 .and. material%dilation < 90)) then
         fault = 'the dilation angle must be in [0, 90)'
      else if (material%dilation > max(lowest, 0.0_wp)) then   ! an angle below 0 is reported by itself
         fault = 'the dilation angle must not be larger than the friction angle, nor than the residual one'
      else if (law%dilation_slip < 0) then
         fault = 'dilation_slip must not be negative'
      end if
   end subroutine set_dilation

   !> Friction coefficient; at rest and before any slip it is tan(phi) for every law but barton_bandis.
   elemental real(wp) function friction_coefficient(law, slip_rate, slip, normal_stress, bonded)
      type(joint_law_type), intent(in) :: law
      real(wp), intent(in) :: slip_rate     !! of the contact, either sign [length/time]
      real(wp), intent(in) :: slip          !! summed up since the contact closed [length]
      real(wp), intent(in), optional :: normal_stress  !! compression positive, for barton_bandis; absent: 0 [stress]
      logical, intent(in), optional :: bonded          !! for residual; absent: true
      real(wp) :: angle, stress
      friction_coefficient = law%friction
      select case (law%law)
      case (strength_law%velocity)
         friction_coefficient = law%final_friction + (law%friction - law%final_friction)*exp(-abs(slip_rate)/law%scale)
      case (strength_law%displacement)
         friction_coefficient = law%friction - (law%friction - law%final_friction)*min(abs(slip)/law%scale, 1.0_wp)
      case (strength_law%residual)
         friction_coefficient = law%friction - (law%friction - law%final_friction)*weakened(law, slip, bonded)
      case (strength_law%barton_bandis)
         stress = 0
         if (present(normal_stress)) stress = normal_stress
         ! the lower bound of the stress is far on the side of the largest angle
         angle = law%base_angle - law%jrc*min(log10(max(stress/law%jcs, tiny(1.0_wp))), 0.0_wp)
         friction_coefficient = tan(min(angle, steepest)*pi/180)/law%reduction
      end select
   end function friction_coefficient

   !> Is the shear strength a constant times the compression?
   elemental logical function is_friction_alone(law)
      type(joint_law_type), intent(in) :: law
      is_friction_alone = law%law == strength_law%coulomb .and. .not. max(law%cohesion, law%residual_cohesion) > 0
   end function is_friction_alone

   !> Share of the way from peak to residual strength, law residual.
   elemental real(wp) function weakened(law, slip, bonded)
      type(joint_law_type), intent(in) :: law
      real(wp), intent(in) :: slip          !! [length]
      logical, intent(in), optional :: bonded
      weakened = min(abs(slip)/law%scale, 1.0_wp)
      if (present(bonded)) then
         if (.not. bonded) weakened = 1
      end if
   end function weakened

   !> Cohesion after a slip [stress].
   elemental real(wp) function cohesion_at(law, slip, bonded) result(cohesion)
      type(joint_law_type), intent(in) :: law
      real(wp), intent(in) :: slip          !! [length]
      logical, intent(in) :: bonded
      cohesion = merge(law%cohesion, law%residual_cohesion, bonded)
      if (law%law == strength_law%residual) &
         cohesion = law%cohesion - (law%cohesion - law%residual_cohesion)*weakened(law, slip, bonded)
   end function cohesion_at

   !> Tensile strength after a slip [stress].
   elemental real(wp) function tension_at(law, slip, bonded) result(tension)
      type(joint_law_type), intent(in) :: law
      real(wp), intent(in) :: slip          !! [length]
      logical, intent(in) :: bonded
      tension = merge(law%tension, law%residual_tension, bonded)
      if (law%law == strength_law%residual) &
         tension = law%tension - (law%tension - law%residual_tension)*weakened(law, slip, bonded)
   end function tension_at

   !> Gap at which a joint carries no stress once it has slipped.
   elemental real(wp) function dilated_gap(law, slip) result(gap)
      type(joint_law_type), intent(in) :: law
      real(wp), intent(in) :: slip          !! |slip| summed up [length]
      gap = law%dilation*min(slip, law%dilation_slip)
   end function dilated_gap

   !> What the slip of the last step has opened, less what was expected of it: at its end the spring had the gap of its
   !> normal force, and the gap at the start of this one is smaller by that.
   elemental real(wp) function opened_last(law, k_n, normal_force, gap, slip) result(opened)
      type(joint_law_type), intent(in) :: law
      real(wp), intent(in) :: k_n           !! [force/length]
      real(wp), intent(in) :: normal_force  !! at the end of the last step [force]
      real(wp), intent(in) :: gap           !! of the spring at the start of this one [length]
      real(wp), intent(in) :: slip          !! |slip| summed up [length]
      opened = 0
      ! none: a row that is new there
      if (.not. (law%dilation > 0 .and. k_n > 0 .and. normal_force > 0)) return
      opened = -normal_force/law%normal%secant(k_n, normal_force) - gap
      opened = max(-dilated_gap(law, slip), min(dilated_gap(law, slip), opened))
   end function opened_last

   !> Largest shear force of a contact. Without a bond it is the friction force of a sliding contact.
   elemental real(wp) function shear_strength(law, normal_force, length, bonded, slip_rate, slip, broken, worn) &
      result(strength)
      type(joint_law_type), intent(in) :: law
      real(wp), intent(in) :: normal_force  !! compression positive [force]
      real(wp), intent(in) :: length        !! contact length [length]
      logical, intent(in) :: bonded         !! has neither opened nor, if it is brittle, slipped yet
      real(wp), intent(in) :: slip_rate     !! [length/time]
      real(wp), intent(in) :: slip          !! [length]
      real(wp), intent(in), optional :: broken   !! part of the length that has lost its bond; absent: none [length]
      logical, intent(in), optional :: worn      !! it has friction alone; absent: no
      real(wp) :: friction, stress
      ! a point on an edge has no area: its stress is beyond every strength of walls
      stress = huge(1.0_wp)
      if (length > 0) stress = max(normal_force, 0.0_wp)/length
      friction = friction_coefficient(law, slip_rate, slip, stress, bonded)
      strength = friction*max(normal_force, 0.0_wp)
      if (present(worn)) then
         if (worn) return
      end if
      strength = strength + cohesion_at(law, slip, bonded)*length
      if (present(broken)) then
         if (bonded .and. broken > 0) &
            strength = strength - (cohesion_at(law, slip, .true.) - cohesion_at(law, slip, .false.))*broken
      end if
      ! the cap of a bond in tension; without tensile strength a contact in tension is only round-off away from 0
      if (normal_force < 0 .and. law%tension > 0) strength = max(0.0_wp, strength + friction*normal_force)
   end function shear_strength

end module rockdda_interaction_joint_strength
