! SPDX-License-Identifier: MIT
!> Strength of contacts: Mohr-Coulomb and further friction laws beside it.
!>
!> Source: Shi's Mohr-Coulomb contact (thesis 3.3). A contact resists slip up to mu N + c l: N the compression,
!> l the contact length; cohesion c (and the tensile strength t l) only while the contact is bonded. The laws
!> differ in the friction coefficient mu:
!>
!>     coulomb        mu = tan(phi)
!>     velocity       mu = mu_d + (tan(phi) - mu_d) exp(-|v|/v_c): Stribeck's form of rate dependence,
!>                    parameters phi_d [deg] (friction at high rates), v_c [length/time] (> 0)
!>     displacement   mu = tan(phi) - (tan(phi) - mu_r) min(|s|/s_c, 1): linear slip weakening (Ida 1972),
!>                    parameters phi_r [deg] (residual friction), s_c [length] (> 0)
!>
!> A new law is one more name in `contact_law`, one case in `new_contact_laws` and one in `friction_coefficient`.
module rockdda_interaction_contact_law
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_options, only : joint_law_type
   implicit none
   private
   public :: contact_law_type, contact_law, new_contact_laws, friction_coefficient, shear_strength

   type :: contact_law_enum
      integer :: coulomb = 1
      integer :: velocity = 2
      integer :: displacement = 3
   end type contact_law_enum
   type(contact_law_enum), parameter :: contact_law = contact_law_enum()

   !> The law of one joint material.
   type :: contact_law_type
      integer :: law = 1                !! one of contact_law%...
      real(wp) :: friction = 0          !! tan of the friction angle, at rest and before slip
      real(wp) :: cohesion = 0          !! [force/length^2], >= 0
      real(wp) :: tension = 0           !! tensile strength [force/length^2], >= 0
      real(wp) :: final_friction = 0    !! mu_d or mu_r; coulomb: not used
      real(wp) :: scale = 1             !! v_c [length/time] or s_c [length], > 0; coulomb: not used
      real(wp) :: damping_ratio = 0     !! Voigt dashpot, fraction of critical, >= 0
   end type contact_law_type

contains

   !> The laws of all joint materials: Coulomb, unless a joint law names the material. Faults of the options
   !> (unknown name or material, wrong parameters, a material named twice) are errors, each where its option was read.
   subroutine new_contact_laws(materials, joint_laws, laws, messages)
      type(joint_material_type), intent(in) :: materials(:)              !! all joint materials
      type(joint_law_type), intent(in) :: joint_laws(:)                  !! may be empty
      type(contact_law_type), allocatable, intent(out) :: laws(:)        !! one per joint material
      type(diagnostics_type), intent(inout) :: messages
      logical, allocatable :: named(:)
      integer :: i, m
      allocate (laws(size(materials)))
      allocate (named(size(materials)))
      named = .false.
      do i = 1, size(materials)
         laws(i)%friction = tan(materials(i)%friction_angle*pi/180)
         laws(i)%cohesion = materials(i)%cohesion
         laws(i)%tension = materials(i)%tension
      end do
      do i = 1, size(joint_laws)
         m = joint_laws(i)%material
         if (m < 1 .or. m > size(materials)) then
            call messages%add(severity%error, 'joint law '//to_string(i)//': there is no joint material '// &
                              to_string(m)//', they are 1 to '//to_string(size(materials)), joint_laws(i)%origin)
         else if (named(m)) then
            call messages%add(severity%error, 'joint law '//to_string(i)//': joint material '//to_string(m)// &
                              ' already has a law', joint_laws(i)%origin)
         else
            named(m) = .true.
            call set_law(joint_laws(i), laws(m), messages)
         end if
      end do
   end subroutine new_contact_laws

   !> Take name, parameters and damping of one option.
   subroutine set_law(option, law, messages)
      type(joint_law_type), intent(in) :: option
      type(contact_law_type), intent(inout) :: law
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: name, where, fault
      integer :: n
      where = 'law of joint material '//to_string(option%material)//': '
      name = 'coulomb'
      if (allocated(option%law)) then
         if (len_trim(option%law) > 0) name = trim(option%law)
      end if
      fault = ''
      n = 0
      if (allocated(option%parameters)) n = size(option%parameters)
      law%damping_ratio = option%damping_ratio
      select case (name)
      case ('coulomb')
         law%law = contact_law%coulomb
         if (n > 0) fault = 'coulomb takes no parameters'
      case ('velocity')
         law%law = contact_law%velocity
         if (n /= 2) fault = 'velocity takes 2 parameters: friction angle at high rates [deg], rate'
      case ('displacement')
         law%law = contact_law%displacement
         if (n /= 2) fault = 'displacement takes 2 parameters: residual friction angle [deg], slip'
      case default
         fault = "unknown law '"//name//"', expected coulomb, velocity or displacement"
      end select
      if (option%damping_ratio < 0) fault = 'the damping ratio must not be negative'
      if (len(fault) == 0 .and. n == 2) then
         if (.not. (option%parameters(1) >= 0 .and. option%parameters(1) < 90)) then
            fault = 'the friction angle must be in [0, 90)'
         else if (.not. option%parameters(2) > 0) then
            fault = 'the second parameter must be positive'
         end if
      end if
      if (len(fault) > 0) then
         call messages%add(severity%error, where//fault, option%origin)
      else if (n == 2) then
         law%final_friction = tan(option%parameters(1)*pi/180)
         law%scale = option%parameters(2)
      end if
   end subroutine set_law

   !> Friction coefficient; at rest and before any slip it is tan(phi) for every law.
   elemental real(wp) function friction_coefficient(law, slip_rate, slip)
      type(contact_law_type), intent(in) :: law
      real(wp), intent(in) :: slip_rate     !! of the contact, either sign [length/time]
      real(wp), intent(in) :: slip          !! summed up since the contact closed [length]
      friction_coefficient = law%friction
      select case (law%law)
      case (contact_law%velocity)
         friction_coefficient = law%final_friction + (law%friction - law%final_friction)*exp(-abs(slip_rate)/law%scale)
      case (contact_law%displacement)
         friction_coefficient = law%friction - (law%friction - law%final_friction)*min(abs(slip)/law%scale, 1.0_wp)
      end select
   end function friction_coefficient

   !> Largest shear force of a contact. With bonded false it is the friction force of a sliding contact.
   elemental real(wp) function shear_strength(law, normal_force, length, bonded, slip_rate, slip)
      type(contact_law_type), intent(in) :: law
      real(wp), intent(in) :: normal_force  !! compression positive; tension gives no friction [force]
      real(wp), intent(in) :: length        !! contact length [length]
      logical, intent(in) :: bonded         !! has neither opened nor slipped yet
      real(wp), intent(in) :: slip_rate     !! [length/time]
      real(wp), intent(in) :: slip          !! [length]
      shear_strength = friction_coefficient(law, slip_rate, slip)*max(normal_force, 0.0_wp)
      if (bonded) shear_strength = shear_strength + law%cohesion*length
   end function shear_strength

end module rockdda_interaction_contact_law
