! SPDX-License-Identifier: MIT
!> Words of the field for what the tables of options name otherwise.
module rockdda_io_synonyms
   use rockdda_base_strings, only : lower_case
   implicit none
   private
   public :: usual_names, other_words_for

   !> The names of an option, and other words for it, a blank before and behind each.
   type :: synonym_type
      character(len=20) :: name
      character(len=110) :: words
   end type synonym_type

   type(synonym_type), parameter :: synonyms(36) = [ &
      synonym_type('friction', ' phi fi angle friction_angle mu tan_phi frictionangle phi_b '), &
      synonym_type('cohesion', ' c coh cohesive_strength adhesion '), &
      synonym_type('tension', ' t ft sigma_t tensile_strength tensile tension_strength rt '), &
      synonym_type('dilation', ' psi dilatancy dilation_angle dilatancy_angle '), &
      synonym_type('normal_stiffness', ' kn k_n jkn stiffness normal '), &
      synonym_type('shear_stiffness', ' ks k_s kt jks stiffness shear '), &
      synonym_type('damping_ratio', ' damping xi zeta d '), &
      synonym_type('restitution', ' cor e_n coefficient_of_restitution '), &
      synonym_type('density', ' rho dens mass_density '), &
      synonym_type('unit_weight', ' gamma weight specific_weight gamma_w gammaw bulk_weight '), &
      synonym_type('young', ' e emod e_mod modulus youngs_modulus young_modulus elastic_modulus '), &
      synonym_type('poisson', ' nu v poissons_ratio poisson_ratio '), &
      synonym_type('gravity', ' g grav acceleration '), &
      synonym_type('stress', ' sigma s insitu_stress '), &
      synonym_type('k0', ' k lateral_pressure stress_ratio '), &
      synonym_type('number', ' id no nr mat index material material_number '), &
      synonym_type('name', ' label title '), &
      synonym_type('dt_max', ' dt timestep time_step step delta_t g1 '), &
      synonym_type('t_end', ' tend t_max tmax end_time duration time '), &
      synonym_type('steps', ' n nstep nsteps n_steps number_of_steps '), &
      synonym_type('displacement_ratio', ' g2 max_displacement displacement '), &
      synonym_type('stiffness', ' g0 penalty contact_stiffness k '), &
      synonym_type('excavate', ' remove excavation delete dig '), &
      synonym_type('place', ' add build construct fill '), &
      synonym_type('pressure', ' p q surcharge load '), &
      synonym_type('record', ' accelerogram earthquake file motion acceleration '), &
      synonym_type('polygon', ' points corners vertices shape '), &
      synonym_type('box', ' rectangle rect '), &
      synonym_type('table', ' water_table level surface points phreatic '), &
      synonym_type('water', ' pore_pressure groundwater ground_water seepage '), &
      synonym_type('boundary', ' boundaries support supports fixed fixity roller bc constraint '), &
      synonym_type('quake', ' earthquake seismic shaking '), &
      synonym_type('bolt', ' bolts anchor anchors rock_bolt rockbolt tie_rod cable '), &
      synonym_type('liner', ' lining linings liners shotcrete support shell beam '), &
      synonym_type('yield_force', ' strength yield capacity ultimate_force '), &
      synonym_type('in_situ', ' insitu initial_stress ground_stress ')]

contains

   !> Names that another word may stand for, those in the table only.
   pure subroutine usual_names(word, table, names)
      character(len=*), intent(in) :: word, table(:)
      character(len=20), allocatable, intent(out) :: names(:)
      logical :: fits(size(synonyms))
      integer :: i
      do i = 1, size(synonyms)
         fits(i) = index(synonyms(i)%words, ' '//trim(lower_case(word))//' ') > 0 .and. any(table == synonyms(i)%name)
      end do
      names = pack(synonyms%name, fits)
   end subroutine usual_names

   !> Other words for a name, a blank between them; '' without any.
   pure function other_words_for(name) result(words)
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: words
      integer :: i
      words = ''
      do i = 1, size(synonyms)
         if (synonyms(i)%name == name) words = trim(adjustl(synonyms(i)%words))
      end do
   end function other_words_for

end module rockdda_io_synonyms
